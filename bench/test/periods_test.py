# SPDX-License-Identifier: Apache-2.0
"""Period jitter of timers in simulated runs, computed a second time from jobs.csv, and in advice."""

import json

import numpy as np

from hotpath_command import CommandTest, RunFolder

NS = 1e6  # per ms


def start_distances(run: RunFolder, executor: str, task: str) -> list[int]:
    """Nanoseconds between the starts of consecutive counted jobs, over all repetitions."""
    warm_up = run.run["warm_up_s"] * 1e9
    distances = []
    for (name, _), jobs in run.jobs().items():
        starts = [
            (job.sequence, job.start)
            for job in jobs
            if name == executor and job.task == task and job.outcome == "ran" and job.timestamp >= warm_up
        ]
        starts.sort()
        distances += [after[1] - before[1] for before, after in zip(starts, starts[1:], strict=False)]
    return distances


class Periods(CommandTest):
    def check_periods(self, run: RunFolder) -> int:
        """Compares summary.json with jobs.csv; returns the number of timers with two jobs."""
        seen = 0
        for executor in run.summary()["executors"]:
            for task in executor["tasks"]:
                if task["kind"] != "timer":
                    self.assertNotIn("period_ms", task)
                    continue
                period = next(t["period_ns"] for t in run.run["tasks"] if t["task"] == task["task"]) / NS
                distances = start_distances(run, executor["executor"], task["task"])
                self.assertEqual(task["period_ms"]["n"], len(distances), task["task"])
                if not distances:
                    continue
                seen += 1
                off = [abs(d / NS - period) for d in distances]
                p99 = float(np.percentile(off, 99))
                expected = [min(distances) / NS, max(distances) / NS, p99, max(off)]
                found = [task["period_ms"]["min"], task["period_ms"]["max"]]
                found += [task["period_deviation_ms"]["p99"], task["period_deviation_ms"]["max"]]
                for a, b in zip(found, expected, strict=True):
                    self.assertAlmostEqual(a, b, places=6, msg=task["task"])
        return seen

    def test_simulated_runs(self) -> None:
        run = self.measure(
            *("simulate", "--executors", "default,rm-ro,rm-re", "--duration", 5, "--warm-up", 0.5),
            *("--repetitions", 2, "--phases", "random"),
        )
        self.assertGreaterEqual(self.check_periods(run), 21)

    def test_advice_names_who_pays(self) -> None:
        """The recommended executor delays a slow timer that today's executor serves in turn."""
        words = "autoware --executors default,rm-ro --repetitions 2 --duration 5 --phases creation".split()
        self.accepted("advise", *words, "--output", "advice")
        advice = json.loads((self.folder / "advice" / "advice.json").read_text())
        rows = {row["name"]: row["periods_ms"] for row in advice["ranking"]}
        now, best = rows[advice["now"]], rows[advice["recommended"]]
        growth = {
            timer: (values["greatest"] - values["least"] - now[timer]["greatest"] + now[timer]["least"])
            / values["period"]
            for timer, values in best.items()
        }
        sentence = next(s for s in advice["sentences"] if "imer" in s and "pay" in s)
        payers = sorted((t for t in growth if growth[t] > 0.05), key=lambda t: -growth[t])
        if not payers:
            self.assertIn("No timer pays", sentence)
            return
        self.assertIn("Timers pay for it: " + payers[0], sentence)
        before, after = (v[payers[0]]["greatest"] - v[payers[0]]["least"] for v in (now, best))
        self.assertIn(f"varies by {after:.1f} ms instead of {before:.1f} ms", sentence)
