# SPDX-License-Identifier: Apache-2.0
"""One use of each command, and the effect of each of its options: what a new command adds."""

from typing import Any

# One real use of each command, and a file that it writes or, after `>`, a text that it prints. Later
# uses read the files of earlier ones.
USES = {
    "simulate --executors default,rm-ro --duration 1 --warm-up 0 --output stored": "stored/summary.json",
    "export perfetto stored --output trace.json": "trace.json",
    "explain stored --executors default,rm-ro": ">is faster than",
    "doctor stored": ">one job per thread at a time",
    "doctor killed --recover": "killed/summary.json",
    "report stored --summary": ">rm-ro",
    "report stored --output page": "page/report.html",
    "diff stored stored --gate --markdown gate.md": "gate.md",
    "diff stored --simulated --output validation": "validation/validation.json",
    "export ctf stored --output exported": "exported/default-0/metadata",
    "import ctf exported/default-0 --output imported": "imported/graph.yaml",
    "advise autoware --repetitions 1 --duration 1 --output advice": "advice/advice.json",
    "analyze timers_only_60 --csv bounds.csv": "bounds.csv",
    "sweep {stock}/sweep.yaml --output swept": "swept/table.csv",
    "capacity --executors rm-ro --duration 1 --resolution 20 --output levels": "levels/levels.csv",
    "paper waters --sets 2 --output waters": "waters/waters.csv",
    "paper table1": ">LiDAR",
    "paper golden --output golden": "golden/validation.json",
    "paper threads": ">confirmed",
    "graph autoware": ">chain hot_path:",
    "graph --new robot.yaml": "robot.yaml",
    "list executors": ">rm-ro",
    "list graphs": ">autoware",
    "list deployments": ">isolated",
    "list figures": ">hot-path",
    "doctor --duration 0.01 --output machine.json": "machine.json",
    "run {brief} --output live": "live/summary.json",
    "watch --once -- true": ">0 events",
    "replay live --duration 0.1": "",
}
# Fields of a row that is printed as JSON.
JSON_HOLDS: dict[str, dict[str, Any]] = {
    "analyze timers_only_60 --csv bounds.csv": {"kind": "task", "name": "FrontCamera", "observed_ns": None},
    "diff stored stored --gate --markdown gate.md": {"worse": False},
    "paper table1": {"task": "Camera"},
    "paper threads": {"chain": "chain2"},
    "list graphs": {"name": "autoware"},
    "list deployments": {"name": "isolated"},
}
# What a use needs that no earlier one writes, as shell code, by its result.
GIVEN = {
    "killed/summary.json": "cp -r stored killed; cd killed; rm summary.json; mv jobs.csv jobs.csv.part;"
    " mv chains.csv chains.csv.part; sed -i 's/complete\": true/complete\": false/' run.json; cd ..;"
}
# They measure for minutes: bench_command_test.py, ../hotpath_report/test/test_reproduction.py.
MEASURES_FOR_MINUTES = {("bench",), ("paper", "figures")}
# Commands whose calls are not noted: second_host_test.py tests what live ones use; the last has too many.
UNNOTED = ("run", "replay", "paper threads")
# Command lines that print no table, and reject --json.
NO_TABLES = (
    *("export perfetto stored", "import ctf", "export ctf", "sweep", "graph", "replay"),
    *("report stored --output page", "list figures"),
)

# The effect of each option. A command's first line is a use; each other line is an option that
# changes the result of that use. `+ WORDS`: both runs have them, too (`-NAME` takes one away).
# `! PART`: the option is rejected with this sentence, since it would be ignored or its effect is to
# reject. `= REASON`: it changes no result. `@ FILE`: that test program shows its effect, or none can.
# For --output and --json, see adverse_use_test.py.
COMMON = """
--graph sequences
--set FrontLidarDriver.period_ms=90
--load=50
--rate 110
--copies 2
--phases synchronous
--entity-order reverse
--seed 2 + --phases random
--deployments isolated + --cores 2
--duration 2
--warm-up 0.5
"""
SIMULATED = f"""{COMMON}
--executors default,edf-ro
--threads=3 = results do not depend on the number of threads
--cores 2 + --executors multi:2
--platform release_cost_us=100
--repetitions 3
--max-backlog 1 + --load 95 --executors rm-ro ! overload: more than 1
--execution-times uniform + --graph callbacks
"""
SIMULATION = "simulate --executors default,rm-ro --output out {short}"
# Values of options that have several kinds of them.
MORE_VALUES = """
--phases | {reference}/rclcpp_autoware_phases.csv | {stock}/autoware | creation:3
--executors | default,rm-ro:first | default,rm-ro:fifo
--platform | timer_thread=equal | pass_cost_us=100 | dispatch_cost_us=100 | timer_dispatch_cost_us=100
--platform | subscription_dispatch_cost_us=100 | wait_cost_us=100 | wait_cost_per_entity_us=10
--platform | wake_up_us=100 | delivery_delay_us=100
"""
EFFECTS = {
    SIMULATION: f"""{SIMULATED}
--work wall = virtual time has one kind of work
--no-trace
""",
    "capacity --executors default,rm-ro --from 60 --to 120 --resolution 30 --repetitions 2 --output out"
    " {short}": f"""{SIMULATED}
--load 50 ! --over
--max-backlog 1
--over rate
--require age:30
--from 30
--to 90
--resolution 15
""",
    "advise --graph autoware --executors default,rm-ro --repetitions 2 --output out {short}": f"""{COMMON}
--graph sequences
--copies 2 + --cores 2
--deployments isolated
--seed 2
--executors default,edf-ro
--threads 3 = results do not depend on the number of threads
--repetitions 3
--for hot_path:age:median
--now rm-ro
--cores 2
--costs graph
--margin 1 ! --phases
--time-out @ advise_command_test.py
""",
    "analyze --graph timers_only_60 --executors default,rm-ro": """
--graph sequences
--set FrontCamera.execution_time_ms=1
--contract @ watch_test.py
--margin @ watch_test.py
--executors edf-ro
--load 50
--rate 90
--copies 2
--phases synchronous
--cores 2 + --platform timer_thread=equal
--platform release_cost_us=100
--exact
--phase-uncertainty-us 100 + --phases synchronous
--witness worst + --phases synchronous
--entity-order reverse + --graph sequences --phases creation
--trace {stock}/timers
--deployments rm-threads
--strict @ analyze_test.py
--csv bounds.csv
""",
    "sweep {stock}/sweep.yaml --output out": "--threads --yes --new @ sweep_test.py",
    "explain {stock}/autoware": """
--executors rm-ro
--repetition 1
--chain lane_detection + explain {stock}/run
--task RearLidarDriver
--hot-path
--worst
--quantile 0.9
--sequence 5
--json
""",
    "replay": """
--executors --repetition --graph --from @ adverse_tables.py
--rate --duration --domain @ live_test.py
--all-interfaces @ it needs another machine
""",
    "graph --graph autoware": """
--graph sequences
--set FrontLidarDriver.period_ms=90 + --as dot
--as dot
--deployments isolated + --as dot
--new robot.yaml -graph
""",
    "paper waters --sets 3 --output out": """
--sets 4
--seed 2
--threads 3 = results do not depend on the number of threads
""",
    "paper figures": "--live --quick --only @ of the package: test_reproduction",
    "doctor {stock}/run": """
--duration @ bench_command_test.py
--recover @ recover_test.py
""",
    "bench": """
--quick --repetitions --only --time-out @ bench_command_test.py
--seed 2 --only nope ! no program
""",
    "report {stock}/tiny": """
--output page
--summary
""",
    "diff {stock}/tiny {stock}/tiny": """
--gate
--across-loads @ diff_test.py
--output @ result_pages_test.py
--simulated --csv --junit --markdown @ adverse_tables.py
""",
    "import ctf {stock}/exported/default-0 --output out": """
--executors static
--deployments {stock}/static.yaml
--chain FrontLidarDriver:ObjectCollisionEstimator
--cores 3
--jobs 100
""",
    "export perfetto {stock}/autoware --output out": """
--executors rm-ro
--repetition 1
--from 300
--to 300
""",
    "watch": "--for --once --contract --fail-on --output --keep --print-environment @ watch_test.py",
    # Of its measured values, which always differ, none counts.
    "run {one} --load 1 --transport intra_process --duration 0.1 --warm-up 0 --output out": f"""{COMMON}
--executors default
--deployments isolated
--load 2
--work wall
--entity-order reverse + --executors default
--duration 0.2
--warm-up 0.1
--quick -duration -warm-up -repetitions
--repetitions 2
--time-out --stack @ adverse_tables.py
--rmw cyclonedds ! --stack
--transport fastdds
--processes 2 + --transport fastdds
--network shared_memory + --transport fastdds
--all-interfaces + --transport fastdds
--domain 7 + --transport fastdds
--cpus 0
--executor-policy other
--timer-policy other
--lock-memory
--live
--against --junit --markdown @ sweep_test.py
""",
}
