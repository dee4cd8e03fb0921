# SPDX-License-Identifier: Apache-2.0
"""`hotpath diff` on simulations: pairs of draws, silent chains, files and errors. comparison_test.cpp
tests the judgement."""

import json
import shutil
import tempfile
from collections import Counter
from pathlib import Path
from typing import Any

from hotpath_command import CommandTest, RunFolder, csv_rows, document

FIELD = Path(__file__).resolve().parent / "field"
TWO = "autoware --duration 3 --phases random --executors default,rm-ro --repetitions 5"


class Diff(CommandTest):
    """Results are made once for all tests."""

    shared: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.shared = Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="hotpath_diff_")))

    def simulate(self, more: str = "", of: str = TWO) -> str:
        output = self.shared / f"{of} {more}".replace(" ", "").replace("/", "")
        if not output.exists():
            self.accepted("simulate", *of.split(), *more.split(), "--output", output)
        return str(output)

    def gate(self, *words: object) -> Any:
        """Exit code, standard output, standard error."""
        return self.command("diff", *words, "--gate")

    def test_finds_five_percent_more_load_every_time(self) -> None:
        for seed in range(1, 51, 10):
            folders = self.simulate(f"--seed {seed}"), self.simulate(f"--load 84 --seed {seed}")
            code, out, err = self.gate(*folders, "--across-loads")
            self.assertEqual((code, err), (1, ""), out)
        self.assertIn("79.8 % to 84 % rm-ro", out)
        self.assertIn("simulated repetitions of equal draws pair by pair", out)

    def test_other_draws_are_independent(self) -> None:
        fired = 0
        for seed in range(1, 41, 10):
            code, out, _ = self.gate(self.simulate(f"--seed {seed}"), self.simulate(f"--seed {seed + 10}"))
            self.assertIn("Simulate both with the same --seed", out)
            fired += code
        self.assertEqual(fired, 0)
        of = "autoware --executors default,rm-ro --repetitions 3 --duration 2 --phases"
        runs = [self.simulate(self.simulate(f"--seed {n}"), of) for n in (1, 11)]
        self.assertIn("independent repetitions", self.gate(*runs)[1])
        code, out, _ = self.gate(self.simulate(), self.simulate("--warm-up 1"))
        self.assertIn("independent repetitions", out)
        self.assertEqual(code, 0, out)
        of = f"{FIELD}/jittered_timers.yaml --executors default"
        runs = [self.simulate(f"--seed {n} --duration {n}", of) for n in (1, 2)]
        self.rejected("diff", *runs, "--gate", says=("the gate needs 3 repetitions", "lasts 1 s"), out=None)

    def test_the_same_simulation_is_no_change(self) -> None:
        for more in ("--threads 1", "--no-trace"):
            code, out, err = self.gate(self.simulate(), self.simulate(more))
            self.assertEqual((code, err), (0, ""))
            self.assertRegex(out, r"^Overall: no difference beyond noise \(all \d+ measures; simulated ")

    def test_each_measure_has_one_verdict_and_the_whole_as_well(self) -> None:
        words = {"worse", "better", "no difference beyond noise", "not comparable (too few samples)"}
        less, more = self.simulate(), self.simulate("--load 84")
        for old, new, whole, code in ((less, more, "worse", 1), (more, less, "better", 0)):
            first = self.accepted("diff", old, new, "--across-loads").splitlines()[0]
            self.assertRegex(first, rf"^By age: {whole} \(([0-6] {whole}, .*; of|all) 6 percentiles\)$")
            judged, out, _ = self.gate(old, new, "--across-loads")
            self.assertEqual((judged, out.split(" (")[0]), (code, f"Overall: {whole}"))
            rows = json.loads(self.accepted("diff", old, new, "--across-loads", "--json"))
            self.assertLessEqual({row["verdict"] for row in rows}, words)
        same = self.accepted("diff", less, less)
        self.assertTrue(same.startswith("By age: no difference beyond noise (all 6 percentiles)\n"), same)
        few = "autoware --duration 1 --executors rm-ro --repetitions"
        one, two = self.simulate("1", few), self.simulate("2", few)
        out = self.accepted("diff", one, two)
        self.assertTrue(out.startswith("By age: not comparable (all 3 percentiles)\n"), out)
        self.assertIn(f"\n{one} lasts 1 s, {less} 3 s: maxima grow", self.accepted("diff", one, less))
        self.assertIn("not comparable (too few samples)", out)
        out = self.accepted("diff", one, self.simulate("", f"{few.replace('rm-ro', 'edf-ro,rm-ro')} 1"))
        self.assertRegex(out, r"\nNot comparable, only in .*: edf-ro\n")
        other = self.simulate("1", few.replace("autoware", "sequences"))
        self.rejected("diff", one, other, says="The graphs differ")

    def test_compares_other_loads_only_on_request(self) -> None:
        for more in ("--gate", ""):
            err = self.rejected("diff", self.simulate(), self.simulate("--load 84"), *more.split())
            self.assertRegex(err, r"has load [\d.]+ %, .* 84 %; compare them with --across-loads")

    def test_counts_losses_without_jobs(self) -> None:
        overloaded = "--load 140", "--load 140 --no-trace --max-backlog 1000000"
        jobs = RunFolder(self.simulate(overloaded[0])).rows("jobs.csv")
        lost = Counter(row["executor"] for row in jobs if row["outcome"] in ("skipped", "overwritten"))
        self.assertGreater(sum(lost.values()), 10)
        for more in overloaded:
            words = (self.simulate(more), self.simulate(), "--gate", "--across-loads", "--json")
            rows = json.loads(self.command("diff", *words)[1])
            found = {row["what"].split()[-1]: row["before"] for row in rows if row["what"].startswith("lost")}
            self.assertEqual(found, {e: lost[e] / 5 for e in ("default", "rm-ro")})

    def test_a_summary_without_losses_is_refused(self) -> None:
        short = self.folder / "short"
        shutil.copytree(self.simulate(), short)
        summary = json.loads((short / "summary.json").read_text())
        for executor in summary["executors"]:
            del executor["losses"]
        (short / "summary.json").write_text(json.dumps(summary))
        for words in ((self.simulate(), short), (short, self.simulate())):
            says = (f"{short}/summary.json", "'losses' not found")
            self.rejected("diff", *words, "--gate", says=says)
        self.accepted("report", "--summary", short)
        self.assertEqual(self.gate(self.simulate(), short)[0], 0)

    def test_a_chain_that_falls_silent_is_worse(self) -> None:
        of = f"{FIELD}/silent_chain.yaml --executors fp-ro --phases random --repetitions 5 --duration 5"
        old, new = self.simulate("", of), self.simulate("--platform dispatch_cost_us=4000", of)
        code, out, _ = self.gate(old, new)
        self.assertEqual(code, 1)
        self.assertRegex(out, r"age x .* outputs +49.2 +0 .* worse")
        self.assertIn(f"\nNo output of x under fp-ro in any repetition of {new}\n", out)
        self.assertEqual(self.gate(new, old)[0], 0)

    def test_parts_of_a_build_are_one_side(self) -> None:
        for side, load in (("old", 80), ("new", 82)):
            for seed in (1, 2, 3):
                words = f"simulate autoware --executors rm-ro --duration 1 --load {load} --seed {seed}"
                self.accepted(*words.split(), "--phases", "random", "--output", f"{side}/000{seed}")
        code, out, _ = self.gate("old", "new", "--across-loads", "--output", "page")
        self.assertEqual(code, 1)
        self.assertIn("equal draws pair by pair", out)
        self.assertIn("| worse |", (self.folder / "page" / "report.md").read_text())
        curves = document(self.folder / "page" / "comparison.json")["targets"][0]["curves"]
        found = [(c["side"], c["executor"], c["repetitions"]) for c in curves]
        self.assertEqual(found, [(0, "rm-ro", 3), (1, "rm-ro", 3)])

    def test_writes_the_rows_as_text_csv_and_json(self) -> None:
        words: Any = ("diff", self.simulate(), self.simulate("--seed 11"))
        text = self.accepted(*words, "--csv", "rows.csv")
        rows = json.loads(self.accepted(*words, "--json"))
        self.assertEqual(csv_rows(self.folder / "rows.csv"), rows)
        of_age = [row["verdict"] for row in rows if row["quantity"] == "age"]
        self.assertEqual(len(of_age), 2 * 3)
        self.assertRegex(text, rf"^By age: [a-z ]+ \(.*{len(of_age)} percentiles\)\n")
        for row in rows:
            shown = (row["percentile"], row["old_ms"], row["new_ms"], row["difference_ms"])
            self.assertIn(" ".join(shown), " ".join(text.split()))
