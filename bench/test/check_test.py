# SPDX-License-Identifier: Apache-2.0
"""`hotpath check` accepts a legal schedule, and reports each kind of illegal edit with its line of
jobs.csv."""

import csv
import json
from typing import Any

import jsonschema
from hotpath_command import JOB_COLUMNS, CommandTest, document

# Includes two threads, at a load that skips timestamps and overwrites samples.
RUN = ("simulate", "--executors", "default,multi:2", "--load", 140, "--duration", 0.6, "--warm-up", 0)
FIRST_LINE = 2  # line of the first row


class Check(CommandTest):
    def setUp(self) -> None:
        super().setUp()
        self.run_folder = self.measure(*RUN)
        self.rows = self.run_folder.rows("jobs.csv")

    def write(self) -> None:
        with open(self.run_folder.path / "jobs.csv", "w", newline="", encoding="utf-8") as file:
            writer = csv.DictWriter(file, JOB_COLUMNS, lineterminator="\n")
            writer.writeheader()
            writer.writerows(self.rows)

    def assert_found(self, *parts: str, at: Any = None) -> None:
        self.write()
        line = f"jobs.csv:{'' if at is None else at + FIRST_LINE}"
        self.rejected("doctor", self.run_folder.path, says=(line, *parts), code=1)

    def set(self, at: Any, **fields: Any) -> None:
        self.rows[at].update({name: str(value) for name, value in fields.items()})

    def started(self, start: int = 0, **fields: Any) -> Any:
        """Index of the next job that ran and has these fields."""
        wanted = ({"outcome": "ran"} | fields).items()
        return next(i for i in range(start, len(self.rows)) if wanted <= self.rows[i].items())

    def later_on_same(self, at: Any, *names: str) -> Any:
        """Index of the next job that ran and agrees with the row `at` in these fields."""
        return self.started(at + 1, **{name: self.rows[at][name] for name in ("executor", *names)})

    def test_a_schedule_is_accepted(self) -> None:
        out = self.accepted("doctor", self.run_folder.path)
        self.assertIn(f"{len(self.rows)} rows of jobs.csv, 2 repetitions", out)
        self.assertLess({"ran", "skipped", "overwritten"}, {row["outcome"] for row in self.rows})

    def test_two_jobs_of_a_worker_at_a_time(self) -> None:
        first = self.started(executor="multi:2")
        second = self.later_on_same(first, "worker")
        self.set(first, finish_ns=int(self.rows[second]["start_ns"]) + 1)
        self.assert_found("its worker is busy", self.rows[second]["task"], at=second)

    def test_an_instant_of_a_job_that_cannot_be(self) -> None:
        last = max(i for i, row in enumerate(self.rows) if row["outcome"] == "running")
        for at, changed, instant, offset, says in (
            (self.started(kind="timer"), "release_ns", "timestamp_ns", -1, "released before its timestamp"),
            (self.started(kind="subscription"), "release_ns", "start_ns", 1, "starts before its release"),
            (self.started(), "finish_ns", "start_ns", -1, "ends before it starts"),
            (self.started(9, kind="timer"), "timestamp_ns", "timestamp_ns", -1, "periods of"),
            (last, "start_ns", None, 600_000_000, "after the end"),
        ):
            with self.subTest(says):
                right = dict(self.rows[at])
                self.set(at, **{changed: offset + (int(right[instant]) if instant else 0)})
                self.assert_found(says, *([] if instant else [str(offset)]), at=at)
                self.rows[at] = right

    def test_rows_not_in_the_order_of_starts(self) -> None:
        at = self.started(kind="subscription", executor="default")
        later = self.later_on_same(at)
        self.rows[at], self.rows[later] = self.rows[later], self.rows[at]
        self.assert_found("not in the order of starts", at=later)

    def test_jobs_of_a_task_in_another_order(self) -> None:
        at = self.started(kind="subscription")
        later = self.later_on_same(at, "task")
        sequences = [self.rows[i]["sequence"] for i in (at, later)]
        self.set(at, sequence=sequences[1])
        self.set(later, sequence=sequences[0])
        self.assert_found("after a later job of its task", at=later)

    def test_samples_of_a_publisher_in_another_order(self) -> None:
        at = self.started(kind="subscription")
        later = self.later_on_same(at, "task", "parent_task")
        self.set(later, timestamp_ns=int(self.rows[at]["timestamp_ns"]) - 1)
        self.assert_found("published later", at=later)

    def test_a_job_that_is_there_twice(self) -> None:
        at = self.started(kind="timer")
        self.rows.insert(at + 1, dict(self.rows[at]))
        self.assert_found("occurs twice", at=at + 1)

    def test_a_row_that_is_lost(self) -> None:
        for outcome in ("ran", "skipped", "overwritten", "queued", "running"):
            with self.subTest(outcome=outcome):
                at = self.started(outcome=outcome)
                row = self.rows.pop(at)
                self.assert_found(f"{row['task']} #{row['sequence']} is lost")
                self.rows.insert(at, row)

    def test_rows_for_more_than_there_was(self) -> None:
        row = [row for row in self.rows if row["kind"] == "subscription" and row["outcome"] == "ran"][-1]
        empty = dict.fromkeys(("release_ns", "start_ns", "finish_ns", "worker", "cpu"), "")
        self.rows.append({**row, **empty, "sequence": "9999", "outcome": "queued"})
        self.assert_found("for more than its")

    def test_repetitions_that_run_json_does_not_name(self) -> None:
        kept = list(self.rows)
        self.rows.append(dict(self.rows[0], repetition="7"))
        self.assert_found("names no such repetition", at=len(kept))
        self.rows = kept + kept[:1]
        self.assert_found("have ended before", at=len(kept))
        self.rows = [row for row in kept if row["executor"] == "default"]
        self.assert_found("multi:2, repetition 0", "#0 is lost")

    def test_a_failed_repetition_has_no_rows(self) -> None:
        failed = dict(self.run_folder.run["runs"][0], repetition=1, failure="It was killed.")
        facts = dict(self.run_folder.run, runs=[*self.run_folder.run["runs"], failed])
        (self.run_folder.path / "run.json").write_text(json.dumps(facts))
        self.assertIn("2 repetitions", self.accepted("doctor", self.run_folder.path))
        self.rows.append(dict(self.rows[-1], executor=failed["executor"], repetition="1"))
        self.assert_found("names no such repetition", at=len(self.rows) - 1)

    def test_wrong_documents(self) -> None:
        for change in ({"more": 1}, {"seed": "1"}, {"version": "0"}, {"runs": [{}]}):
            with self.assertRaises(jsonschema.ValidationError):
                document(self.run_folder.path / "run.json", json.dumps(self.run_folder.run | change))

    def test_what_cannot_be_checked(self) -> None:
        file = self.run_folder.path / "run.json"
        file.write_text(json.dumps(dict(self.run_folder.run, tasks=[])))
        self.rejected("doctor", self.run_folder.path, says="its run.json has no tasks")
        for key in ("tasks", "entity_order", "deployments"):
            file.write_text(json.dumps({k: v for k, v in self.run_folder.run.items() if k != key}))
            self.rejected(
                "doctor", self.run_folder.path, says=("run.json is not one of", f"'{key}' not found")
            )
        out = self.accepted("simulate", "--no-trace", "--duration", 0.1, "--output", "without")
        self.assertIn("Results", out)
        self.rejected("doctor", "without", says="jobs.csv: cannot be read (No such file")
