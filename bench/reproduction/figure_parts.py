# SPDX-License-Identifier: Apache-2.0
"""What the figures of samples share: the rows of their CSV, and the key of the two halves of a row."""

from drawing import FAINT, INK, add_key, plt
from inference import PERCENTILE_NAMES, PERCENTILES

SOURCES = ("simulated", "live")
DASHED = (0, (5, 3))


def percentile_rows(samples, *keys):
    """Rows of a figure's CSV: value and interval of each percentile."""
    for p in PERCENTILES:
        e = samples.estimate(p)
        interval = [f"{e.low:.6f}", f"{e.high:.6f}"] if e.has_interval else ["", ""]
        yield [*keys, len(samples.repetitions), len(samples), PERCENTILE_NAMES[p], f"{e.value:.6f}", *interval]


PERCENTILE_HEADER = ["repetitions", "samples", "percentile", "value_ms", "low_95_ms", "high_95_ms"]


def reference_key(label):
    """The mark of what the real ROS 2 stack measured."""
    return plt.Line2D(
        [], [], linestyle="", marker="D", markersize=5, markerfacecolor="none", markeredgecolor=INK, label=label
    )


def source_key(axes, sources, reference=False, more=()):
    """What the two halves of a row are, and the marks; `more` are the handles of further ones."""
    handles = []
    if "simulated" in sources:
        handles.append(plt.Rectangle((0, 0), 1, 1, facecolor=FAINT, alpha=0.42, label="upper half: simulated"))
    if "live" in sources:
        handles.append(plt.Rectangle((0, 0), 1, 1, facecolor=FAINT, alpha=0.95, label="lower half: live"))
    handles.append(plt.Line2D([], [], color=INK, linewidth=1.6, label="median"))
    if reference:
        handles.append(reference_key("worst of the real ROS 2 stack"))
    add_key(axes.figure, [*handles, *more], 6)
