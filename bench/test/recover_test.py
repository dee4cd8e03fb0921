# SPDX-License-Identifier: Apache-2.0
"""Kills the command at random instants, HOTPATH_KILLS (default 6) times, and recovers the stored
repetitions.

With HOTPATH_PUBLISH=1, the counts are published as results/reliability/kills.json.
"""

import json
import os
import random
import shutil
import tempfile
import time
from pathlib import Path
from typing import Any

from evidence import publish_on_request
from hotpath_command import CommandTest, RunFolder, processes_of

KILLS = int(os.environ.get("HOTPATH_KILLS", "6"))
RUN = ("run", "--executors", "default,rm-ro", "--repetitions", 4, "--transport", "intra_process",
       "--load", 1, "--duration", 0.1, "--warm-up", 0)  # fmt: skip


class Recover(CommandTest):
    shared: Path

    @classmethod
    def setUpClass(cls) -> None:
        cls.shared = Path(cls.enterClassContext(tempfile.TemporaryDirectory(prefix="hotpath_recover_")))

    def kill_after(self, seconds: float, output: Path) -> None:
        """Starts a run, kills it after `seconds`, and waits until its children have ended."""
        process = self.start(*RUN, "--output", output)
        try:
            process.wait(timeout=seconds)
        except Exception:  # pylint: disable=broad-except
            process.kill()
        self.finish(process)
        self.wait_for(lambda: not processes_of(process.pid), "a process lives on")

    def named_runs(self, folder: Path) -> Any:
        file = folder / "run.json"
        return json.loads(file.read_text())["runs"] if file.exists() else []

    def defect_of(self, folder: Path) -> Any:
        """A description of the defect of a recovered run; empty: none."""
        run = RunFolder(folder)
        if run.run["complete"] or not run.run["partial"] or "was killed" not in str(run.run["warnings"]):
            return "it is not marked partial, or gives no warning"
        if any(f.endswith(".part") for f in run.files()):
            return "parts are left"
        if set(run.jobs()) != {(r["executor"], r["repetition"]) for r in run.run["runs"]}:
            return "rows and run.json name other repetitions"
        if not run.accounts_for_all():
            return "rows are missing"
        return self.command("doctor", folder)[2]

    def test_killed_at_random_instants(self) -> None:
        instants = random.Random(KILLS)
        recovered = refused = 0
        began = time.monotonic()
        self.measure(*RUN)
        whole_s = time.monotonic() - began
        for k in range(KILLS):
            folder = self.folder / f"run{k}"
            self.kill_after(instants.uniform(0, whole_s), folder)
            if (folder / "run.json").exists() and RunFolder(folder).run["complete"]:
                continue  # it ended before the kill
            if self.named_runs(folder):
                self.accepted("doctor", "--recover", folder)
                self.assertEqual(self.defect_of(folder), "")
                recovered += 1
            else:
                self.rejected("doctor", "--recover", folder, says="hotpath: doctor --recover")
                self.assertFalse((folder / "jobs.csv").exists())
                refused += 1
        print(f"{recovered} recovered, {refused} killed before anything was stored")
        if KILLS >= 6:
            self.assertGreater(recovered, 0)
        facts = {"kills": KILLS, "recovered": recovered, "nothing_stored": refused}
        publish_on_request("reliability/kills.json", facts)

    def whole_run(self) -> Any:
        """A copy of one run, made by the first test that needs it."""
        kept = self.shared / "run"
        if not kept.exists():
            self.accepted(*RUN, "--output", kept)
        shutil.copytree(kept, self.folder / "run")
        return self.checked("run")

    def killed_copy(self, rows: Any) -> Any:
        """A folder as left by a kill; jobs.csv.part holds only this share of its bytes."""
        whole = self.whole_run()
        folder = self.folder / "killed"
        shutil.copytree(whole.path, folder)
        facts = dict(whole.run, complete=False)
        (folder / "run.json").write_text(json.dumps(facts))
        (folder / "summary.json").unlink()
        text = (folder / "jobs.csv").read_bytes()
        (folder / "jobs.csv.part").write_bytes(text[: int(len(text) * rows)])
        (folder / "jobs.csv").unlink()
        (folder / "chains.csv").rename(folder / "chains.csv.part")
        return folder

    def test_rows_of_an_unfinished_repetition_are_left_out(self) -> None:
        folder = self.killed_copy(1)
        with open(folder / "jobs.csv.part", "a", encoding="utf-8") as jobs:
            jobs.write("rm-ro,99,FrontLidarDriver,timer,0,ran,1,1,1,2,,3,0,0,0,,\nrm-ro,99,Front")
        (folder / ".run.json.Ab3dEf.part").write_text("{")  # of a replacement that was interrupted
        self.accepted("doctor", "--recover", folder)
        self.assertEqual(self.defect_of(folder), "")

    def test_failed_repetitions_are_not_recovered(self) -> None:
        folder = self.killed_copy(1)
        facts = json.loads((folder / "run.json").read_text())
        for run in facts["runs"]:
            run["failure"] = "It was killed."
        (folder / "run.json").write_text(json.dumps(facts))
        self.rejected("doctor", "--recover", folder, says="before its first repetition ended")

    def test_the_check_finds_rows_that_were_not_on_disk(self) -> None:
        """Emulates a run.json that names a repetition whose rows were not stored yet."""
        folder = self.killed_copy(0.9)
        self.command("doctor", "--recover", folder)
        self.assertIn(
            self.defect_of(folder), ("rows are missing", "rows and run.json name other repetitions")
        )

    def test_killed_before_it_said_how_it_ended(self) -> None:
        whole = self.whole_run()
        (whole.path / "run.json").write_text(json.dumps(dict(whole.run, complete=False)))
        self.accepted("doctor", "--recover", whole.path)
        self.assertEqual(self.defect_of(whole.path), "")

    def test_nothing_to_recover(self) -> None:
        self.rejected("doctor", "--recover", self.whole_run().path, says="`hotpath report --summary`")
        self.rejected("doctor", "--recover", self.folder, says="run.json")

    def test_results_are_the_users_alone(self) -> None:
        whole = self.whole_run()
        for file in [whole.path, *whole.path.iterdir()]:
            self.assertEqual(file.stat().st_mode & 0o077, 0, file)
