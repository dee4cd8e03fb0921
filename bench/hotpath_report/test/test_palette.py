# SPDX-License-Identifier: Apache-2.0
"""Colours that people with a colour vision deficiency tell apart, or that differ in dash as well."""

import itertools
import unittest

import numpy as np

from hotpath_report import style
from hotpath_report.figures.hot_path import with_ratios
from hotpath_report.figures.violins import Row
from hotpath_report.hotpath_command import ask, registry
from hotpath_report.statistics import Samples, Values

# Simulation at full severity, for linear RGB: Machado, Oliveira and Fernandes, "A Physiologically-based
# Model for Simulation of Color Vision Deficiency", IEEE TVCG 15(6), 2009, table 1 at 1.0.
DEFICIENCIES = {
    "none": np.eye(3),
    "protanopia": np.array(
        [[0.152286, 1.052583, -0.204868], [0.114503, 0.786281, 0.099216], [-0.003882, -0.048116, 1.051998]]
    ),
    "deuteranopia": np.array(
        [[0.367322, 0.860646, -0.227968], [0.280085, 0.672501, 0.047413], [-0.011820, 0.042940, 0.968881]]
    ),
    "tritanopia": np.array(
        [[1.255528, -0.076749, -0.178779], [-0.078411, 0.930809, 0.147602], [0.004733, 0.691367, 0.303900]]
    ),
}
# sRGB to XYZ, and the white point D65 (IEC 61966-2-1).
XYZ = np.array(
    [[0.4124564, 0.3575761, 0.1804375], [0.2126729, 0.7151522, 0.0721750], [0.0193339, 0.1191920, 0.9503041]]
)
WHITE = XYZ.sum(axis=1)
# CIE 1976 differences in L*a*b*: about 2.3 is just noticeable (Mahy et al. 1994).
LEAST = 15.0


def lab(colour: str, deficiency: str) -> Values:
    """CIE L*a*b* of #RRGGBB as seen with a deficiency."""
    srgb = np.array([int(colour[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    seen = np.clip(DEFICIENCIES[deficiency] @ linear, 0, 1)
    t = XYZ @ seen / WHITE
    f = np.where(t > (6 / 29) ** 3, np.cbrt(t), t / (3 * (6 / 29) ** 2) + 4 / 29)
    return np.array([116 * f[1] - 16, 500 * (f[0] - f[1]), 200 * (f[1] - f[2])])


def distance(a: str, b: str, deficiency: str) -> float:
    """How different two colours look."""
    return float(np.linalg.norm(lab(a, deficiency) - lab(b, deficiency)))


class Palette(unittest.TestCase):
    def test_the_simulation_knows_what_is_confused(self) -> None:
        """Red and green are close only for a viewer who lacks red or green cones; black and white never are."""
        self.assertGreater(distance("#c00000", "#5f6f00", "none"), 60)
        self.assertLess(distance("#c00000", "#5f6f00", "deuteranopia"), 10)
        for deficiency in DEFICIENCIES:
            self.assertAlmostEqual(distance("#000000", "#ffffff", deficiency), 100, delta=1.5)

    def test_causes_differ_in_colour(self) -> None:
        """They are areas, which have no dash."""
        causes = ask("page", ["no run"])["causes"]
        for (a, b), deficiency in itertools.product(itertools.combinations(causes, 2), DEFICIENCIES):
            found = distance(a["colour"], b["colour"], deficiency)
            self.assertGreaterEqual(found, LEAST, f"{a} and {b} with {deficiency}")

    def test_executors_differ_in_colour_or_dash(self) -> None:
        for (a, b), deficiency in itertools.product(itertools.combinations(registry(), 2), DEFICIENCIES):
            if style.dashes_of([a]) == style.dashes_of([b]):
                found = distance(style.colour_of(a), style.colour_of(b), deficiency)
                self.assertGreaterEqual(found, LEAST, f"{a} and {b} with {deficiency}")

    def test_curves_of_one_colour_differ_in_dash(self) -> None:
        for name in registry():
            dashes = style.dashes_of([name, "default" if name != "default" else "static", name, f"{name}:2"])
            self.assertEqual(len({str(dashes[k]) for k in (0, 2, 3)}), 3, name)
        unknown = list(map(str, style.dashes_of(["picas", "cie", "chain-first"])))
        self.assertEqual(len(set(unknown)), 3)


class Ratios(unittest.TestCase):
    def test_refer_to_default_on_the_same_stack(self) -> None:
        worst = {"default": 30, "rm-ro": 15, "default@rclcpp": 60, "rm-ro@rclcpp": 15, "rm-ro@other": 15}
        rows = [Row(name, name, {"live": Samples([[ms]])}) for name, ms in worst.items()]
        notes = [row.notes["live"] for row in with_ratios(rows)]
        self.assertEqual(notes, ["", " · 2× lower", "", " · 4× lower", ""])
