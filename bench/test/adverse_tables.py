# SPDX-License-Identifier: Apache-2.0
"""The command lines of the tests that misuse commands, and what must come of each. Only these
tables name commands and options. `{stock}` is the folder of test_inputs.py."""

import json
from pathlib import Path
from typing import Any

REFERENCE = Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference"


def rows(table: str, columns: int = 0) -> list[list[str]]:
    """The rows of a table, filled to this number of columns."""
    found = [[cell.strip() for cell in line.split("|")] for line in table.strip().splitlines()]
    return [row + [""] * (columns - len(row)) for row in found]


def words(line: str, stock: Any, **places: object) -> list[str]:
    """The words of a command line."""
    return line.format(stock=stock, reference=REFERENCE, brief=BRIEF, **places).split()


BRIEF = "--transport intra_process --load 5 --duration 0.2 --warm-up 0"
LONG = "--duration 3000"

# By command: one real use, and a file that it writes or, after `>`, a text that it prints. Later
# uses read the files of earlier ones.
USES = {
    "simulate": ("--executors default,rm-ro --duration 1 --warm-up 0 --output stored", "stored/summary.json"),
    "timeline": ("stored --perfetto trace.json", "trace.json"),
    "explain": ("stored --executor default,rm-ro", ">is faster than"),
    "check": ("stored", ">one job per thread at a time"),
    "summarize": ("stored --responses responses.csv", "responses.csv"),
    "recover": ("killed", "killed/summary.json"),
    "report": ("stored --output page", "page/report.html"),
    "compare-results": ("stored stored --gate --markdown gate.md", "gate.md"),
    "validate": ("stored --output validation", "validation/validation.json"),
    "export": ("ctf stored --output exported", "exported/default-0/metadata"),
    "import": ("ctf exported/default-0 --output imported", "imported/graph.yaml"),
    "advise": ("autoware --draws 1 --duration 1 --output advice", "advice/advice.json"),
    "analyze": ("timers_only_60 --csv bounds.csv", "bounds.csv"),
    "sweep": ("sweep.yaml --output swept", "swept/table.csv"),
    "capacity": ("--executors rm-ro --duration 1 --resolution 20 --output levels", "levels/levels.csv"),
    "experiment": ("waters --sets 2 --utilisations 0.5 --output waters", "waters/waters.csv"),
    "graph": ("autoware", ">chain hot_path:"),
    "list": ("executors", ">rm-ro"),
    "machine": ("--duration 0.01 --output machine.json", "machine.json"),
    "run": (f"{BRIEF} --output live", "live/summary.json"),
    "compare": (
        f"{BRIEF} --repetitions 1 --executors default,rm-ro --output compared",
        "compared/summary.json",
    ),
    "watch": ("--once -- true", ">0 events"),
    "completion": ("bash", ">complete"),
    "replay": ("live --live --duration 0.1", ""),
}
SWEEP = "command: simulate\nfixed: {graph: autoware, duration: 1, warm-up: 0}\naxes: {load: [40, 80]}\n"
MEASURES_FOR_MINUTES = {"bench"}  # with programs next to the command: bench_command_test.py
NETWORKED = {"run", "compare", "replay"}  # second_host_test.py tests what they use
# Commands that print no table, and reject --json.
NO_TABLES = {"timeline", "check", "export", "import", "sweep", "graph", "completion", "replay"}
# The arguments with which a command prints JSON, where they are not those above and --json.
PRINTS_JSON = {"report": "stored --json", "watch": "--once --json -- true"}

# Rows of printed JSON have the names of the stored files: command line, fields of one row.
JSON_HOLDS: dict[str, dict[str, Any]] = {
    "analyze timers_only_60 --executors rm-ro": {"kind": "task", "name": "FrontCamera", "observed_ns": None},
    "analyze timers_only_60 --executors rm-ro --chain IMU,FrontCamera": {"chain": "IMU -> FrontCamera"},
    "list graphs": {"name": "autoware"},
    "list deployments": {"name": "isolated"},
    "experiment wcrt-table": {"task": "Camera"},
    "compare-results {stock}/run {stock}/run --gate": {"worse": False},
}
SUMMARISED = "simulate --executors rm-ro --duration 1"

# Words that are rejected before anything happens | parts of the one sentence.
REJECTED = """
| a command is missing | run, compare
rum | `rum` | run, compare
run --fast | --fast | hotpath run --help
run --duration soon | --duration | `soon` | 0.1
run --repetitions 2.5 | --repetitions | `2.5` | whole number
run --repetitions 0 | --repetitions | 1 to 10000
run --load -1 | --load | `-1`
run --transport tcp | --transport | tcp | fastdds,intra_process
run --domain 233 | --domain | 0 to 232
run --executor best | `best` | edf-ro
run --executor rm-ro:last | `last` | inherit
run --executor multi:0 | between 1 and
compare --executors rm-ro,rm-ro | `rm-ro` | twice
run --cpus 4000 | --cpus | may not use processor 4000
run --cpus 1- | --cpus | `1-`
run --timer-policy fifo | `fifo` | fifo:N
run --processes 2 --transport intra_process | --processes | fastdds
run --processes 25 | --processes | 24 nodes
run --phases given | --phases given | phase_ms
run --phases-file absent.csv | absent.csv
run --graph autowear | autowear | autoware
run --graph ./absent.yaml | absent.yaml | cannot be read (No such file
run --graph {stock} | {stock}
run --graph {stock}/period.yaml | period.yaml:3 | period
graph {stock}/open.yaml | open.yaml:
run --stack ros | --stack | native
run {brief} --output /proc/x | /proc/x | --output
import ctf nowhere | cannot be read (No such file
import ctf {stock}/bounds | holds no CTF trace
import ctf {stock}/json_ctf | ctf-1.8
import ctf {stock}/text_ctf | is not CTF
import ctf /proc | /proc
import ctf {stock}/ctf/rm-ro-0 --chain A | is not SOURCE
import ctf {stock}/ctf/rm-ro-0 --chain nobody:nothing | is not a node or task
import ctf {stock}/ctf/rm-ro-0 --deployment {stock}/nobody.yaml --output new | Nobody
run --quick --duration 5 | --quick | --duration
run --quick --repetitions 5 | --quick | --repetitions
run --executor rm-ro --deployments isolated | --executor | --deployments
run --transport intra_process --network shared_memory | --transport | --network
run --transport intra_process --domain 3 | --transport | --domain
run --transport intra_process --all-interfaces | --transport | --all-interfaces
run --ros2-runner x | --ros2-runner | --stack
run --rmw cyclonedds | --rmw | --stack
compare --against x --quick | --against | --quick
simulate --phases random --phase-step 3 | --phases | --phase-step
simulate --phases given --phases-file x | --phases | --phases-file
simulate --phases given --phases-of x | --phases | --phases-of
simulate --phase-step 3 --phases-of x | --phase-step | --phases-of
advise --phase-step 3 | --phases | --phase-step
advise autoware --graph sequences | --graph | GRAPH
analyze autoware --phases random --phases-of x | --phases | --phases-of
analyze autoware --phases random --phases-file x | --phases | --phases-file
analyze autoware --phases-of x --phases-file x | --phases-of | --phases-file
analyze autoware --trace x --rate 50 | --trace | --rate
analyze autoware --trace x --copies 2 | --trace | --copies
analyze autoware --trace x --entity-order reverse | --trace | --entity-order
analyze autoware --chain a,b --csv x | --chain | --csv
analyze autoware --delta-us 1 --release-cost-us 2 | --delta-us | --release-cost-us
analyze autoware --chain nope | --chain | nope
bench --compare a b --repetitions 3 | --compare | --repetitions
bench --quick --repetitions 3 | --quick | --repetitions
summarize run --golden x | RUN | --golden
summarize --golden x --json | --golden | --json
compare --against x --json | --against | --json
explain run --worst --sequence 3 | --worst | --sequence
explain {stock}/timers --executor static | no executor static
explain {stock}/run --executor rm-ro,rm-ro | the same
explain {stock}/run --executor a,b,c | --executor
explain {stock}/autoware --executor rm-ro --chain hot | hot_path
explain {stock}/autoware --executor rm-ro --task RearLidar | RearLidarDriver
explain {stock}/autoware --executor rm-ro --sequence 100000 | --sequence
explain {stock}/autoware --executor rm-ro --repetition 7 | repetition 7
explain {stock}/run {stock}/autoware | different tasks
explain run run --worst | --worst
explain {stock}/autoware --worst --quantile 0.5 | --worst
timeline {stock}/timers --executor rm-ro --executor rm-ro --perfetto x | --csv and --perfetto take one executor
timeline {stock}/timers --from 5 --to 4 | --to must lie after --from
replay {stock}/tiny | --live
replay {stock}/tiny --live --executor best | best | rm-ro (repetition 0)
replay {stock}/tiny --live --repetition 1 | repetition 1 | rm-ro (repetition 0)
replay {stock}/tiny --live --start 5 | --start
replay {stock}/tiny --live --speed 0 | --speed
replay {stock}/tiny --live --graph sequences | no task | another graph
run --live-cpus 0 | --live-cpus | --live
run --live --live-cpus 4000 | --live-cpus | may not use processor 4000
run --live-alternate | --repetitions
run --live --live-alternate | --live
simulate --cores 0 | --cores | from 1 to 64
simulate --cores 1.5 | --cores | whole number
simulate --release-cost-us -1 | --release-cost-us | from 0
simulate --duration 1e12 | --duration | from 0.1 to 1e+09
simulate --duration 1e9 | --duration | memory | --no-trace
simulate --execution-times best | --execution-times | worst, uniform
simulate --executors rm-or | rm-or | rm-ro
simulate --graph {stock}/tiny.yaml --phases-file {stock}/phases.csv | phases.csv:2
simulate --executors rm-ro --execution-times replay:{stock}/timers | jobs.csv: | another graph
simulate --executors rm-ro --phases-of {stock}/timers | --phases-of | another graph
simulate --phases-of {stock}/bounds | run.json
simulate --graph timers_only_60 --executors edf-ro --execution-times replay:{stock}/timers | edf-ro (repetition 0)
capacity --require fast | --require: `fast`
capacity --over copies --from 0.5 | whole numbers
capacity --from 9 --to 5 | --from is greater than --to
capacity --live --cores 2 | --cores applies to simulations only
capacity --live --live-options=--graph=x | --live-options: --graph is an option of capacity itself
capacity --live --live-options=--nope=x | --nope=x; see `hotpath run --help`
capacity --live --live-options=--domain=x | --live-options: --domain
explain run --chain a --task b | --chain | --task
capacity --over load --load 50 | --over | --load
capacity --over copies --from 1 --to 2000 | --over | --copies | 1000
capacity --over rate --from 0 | --over | --rate
capacity --live-options --quick | --live-options | --live
simulate --executors , | --executors: `,` has an empty item
compare --executors a,,b | --executors: `a,,b` has an empty item
run --stack , | --stack: `,` has an empty item
bench --only a, | --only: `a,` has an empty item
simulate --deployments ,a | --deployments: `,a` has an empty item
capacity --require , | --require: `,` has an empty item
analyze autoware --chain , | --chain: `,` has an empty item
explain run --executor , | --executor: `,` has an empty item
experiment waters --utilisations 0.5, | --utilisations: `0.5,` has an empty item
"""
# Numbers are read strictly: words | values that are not whole numbers of the range.
NUMBERS = {
    "simulate --seed": "-1 +1 0x10 1e3 18446744073709551616 1.0",
    "experiment waters --threads": "-1 1025",
    **{f"{c} --seed": "-1" for c in ("run", "compare", "capacity", "advise", "bench", "experiment waters")},
}
# ROS 2's stack rejects what it would ignore; $ROS_DISTRO | words | parts of the sentence.
ROS2_RUN = f"run --stack rclcpp {BRIEF}"
ON_ROS2 = "run --stack rclcpp --ros2-runner /bin/true --duration 1"
REJECTED_ON_ROS2 = """
| --copies 2 | --stack rclcpp | leave | --copies
| --rate 50 | --stack rclcpp | leave | --rate
| --processes 2 | --stack rclcpp | leave | --processes
| --cpu-time | --stack rclcpp | leave | --cpu-time
| --transport intra_process | --stack rclcpp | leave | --transport
| --entity-order reverse | --stack rclcpp | leave | --entity-order
| --rmw nonsense | --rmw nonsense | rmw_nonsense_cpp
| --executor events-ro --timer-policy other | events-ro@rclcpp | --executor-policy
| --executor multi-fair | multi-fair@rclcpp | rclcpp has no such executor | static
kilted | --executor static | static@rclcpp | ROS 2 kilted | events-re
humble | --executor events-re | events-re@rclcpp | ROS 2 humble | static, multi, rm-ro
"""
# An option that changes nothing for these executors: a note says so.
NOTED = tuple(
    f"simulate --duration 1 --output out --executors {words}"
    for words in ("default --ties fifo", "default --rule first", "rm-ro --entity-order reverse")
)

# The effect of each option. A command's first line is a use; each other line is an option that
# changes the result of that use. `+ WORDS`: both runs have them, too (`-NAME` takes one away).
# `! PART`: the option is rejected with this sentence, since it would be ignored or its effect is to
# reject. `= REASON`: it changes no result. `@ FILE`: that test program shows its effect, or none can.
# For --output and --json, see adverse_use_test.py.
COMMON = """
--graph sequences
--load 50
--rate 110
--copies 2
--phases synchronous
--phases-file {reference}/rclcpp_autoware_phases.csv
--phase-step 3 + --phases creation
--rule first
--entity-order reverse
--ties fifo
--seed 2 + --phases random
--deployments isolated + --cores 2
--duration 2
--warm-up 0.5
"""
SYSTEM = (
    COMMON
    + """
--executors default,edf-ro
--threads 3 = results do not depend on the number of threads
"""
)
PLATFORM = """
--cores 2 + --executors multi:2
--timer-thread equal
--release-cost-us 100
--pass-cost-us 100
--dispatch-cost-us 100
--timer-dispatch-cost-us 100
--subscription-dispatch-cost-us 100
--wait-cost-us 100
--wait-cost-per-entity-us 10
--wake-up-us 100
--delivery-delay-us 100
"""
SIMULATED = (
    SYSTEM
    + PLATFORM
    + """
--phases-of {stock}/autoware
--repetitions 3
--max-backlog 1 + --load 95 ! overload: more than 1
--execution-times uniform + --graph callbacks
"""
)
LIVE = (
    COMMON
    + """
--executor rm-ro + --executor default
--deployments isolated + -executor
--load 2
--work wall
--entity-order reverse + --executor default
--duration 0.2
--warm-up 0.1
--quick -duration -warm-up
--repetitions 2
--time-out @ adverse_runs_test.py
--stack @ adverse_tables.py
--ros2-runner x ! --stack
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
--cpu-time + --work wall
--live
--live-alternate + --repetitions 2
--live-cpus 0 + --live
"""
)
SIMULATION = "simulate --executors default,rm-ro --output out --duration 1 --warm-up 0"
STORED = "simulate --executors=rm-ro --rate=110 --duration=1"
VALIDATE = ("validate",)
EFFECTS = {
    SIMULATION: SIMULATED
    + """
--work wall = virtual time has one kind of work
--no-trace
""",
    "capacity --executors default,rm-ro --from 60 --to 120 --resolution 30 --coarse 3 --repetitions 2 --output out"
    " --duration 1 --warm-up 0": SIMULATED
    + """
--load 50 ! --over
--work wall ! --live
--phases synchronous
--timer-thread equal + --executors rm-re
--max-backlog 1
--over rate
--require latency:30
--from 30
--to 90
--resolution 15
--coarse 2
--live --threads 2 ! --threads
--live-options=--domain=3 ! --live
""",
    "advise autoware --executors default,rm-ro --draws 2 --output out --duration 1 --warm-up 0": SYSTEM
    + """
--graph sequences + -operand
--copies 2 + --cores 2
--deployments isolated
--seed 2
--for hot_path:median
--now rm-ro
--cores 2
--costs graph
--draws 3
--margin 1 ! --phases
--budget @ advise_command_test.py
""",
    "analyze timers_only_60 --executors default,rm-ro": PLATFORM
    + """
--contract @ watch_test.py
--executors edf-ro
--load 50
--rate 90
--copies 2
--phases synchronous + --chain IMU,FrontCamera
--phases-file {reference}/traces/timers_only_80.rm-ro.csv + --chain IMU,FrontCamera
--phases-of {stock}/timers + --chain IMU,FrontCamera
--cores 2 + --timer-thread equal
--exact
--phase-uncertainty-us 100 + --phases synchronous
--witness worst + --phases synchronous
--entity-order reverse + -operand sequences --phases creation
--trace {stock}/timers
--deployments rm-threads
--strict @ analyze_test.py
--chain IMU,FrontCamera
--csv bounds.csv
--page page
--delta-us 100
""",
    "sweep {stock}/sweep.yaml --output out": """
--threads @ sweep_test.py
--rank-time-out @ sweep_test.py
--yes @ sweep_test.py
""",
    "timeline {stock}/autoware --csv rows.csv": """
--executor rm-ro
--repetition 1
--from 300
--to 300
--svg @ simulate_test.py
--perfetto trace.json -csv
--csv other.csv
""",
    "explain {stock}/autoware": """
--executor rm-ro
--repetition 1
--chain lane_detection + -operand {stock}/run
--task RearLidarDriver
--worst
--quantile 0.9
--sequence 5
--json
""",
    "replay": """
--live --executor --repetition --speed --start --duration --domain @ live_test.py
--graph @ adverse_tables.py
--all-interfaces @ it needs another machine
""",
    "validate {stock}/autoware --output out": """
--reference nowhere ! nowhere
--all
""",
    "list executors": "",
    "list graphs": "",
    "list deployments": "",
    "graph autoware": """
--dot
--svg
--cie
--deployment isolated + --dot
""",
    "experiment wcrt-table --output out": "",
    "experiment waters --sets 3 --utilisations 0.5 --output out": """
--sets 4
--utilisations 0.6
--seed 2
--threads 3 = results do not depend on the number of threads
--paper-only
""",
    "machine": """
--duration --output @ bench_command_test.py
""",
    "bench": """
--quick --repetitions --only --time-out --output --compare @ bench_command_test.py
--seed 2 --compare a b ! --compare
--json ! --compare
""",
    "summarize {stock}/autoware": """
--responses responses.csv
--golden {reference}/traces/timers_only_80.rm-ro.csv -operand
""",
    "report {stock}/tiny": """
--output page
--json
""",
    "compare-results {stock}/tiny {stock}/tiny": """
--gate
--across-loads @ ../hotpath_report/test/test_gate.py
--page @ result_pages_test.py
--csv --junit --markdown @ adverse_tables.py
""",
    "import ctf {stock}/exported/default-0 --output out": """
--executor static
--deployment {stock}/static.yaml
--chain FrontLidarDriver:ObjectCollisionEstimator
--cores 3
--jobs 100
""",
    "export ctf {stock}/autoware --output out": "",
    "recover": "",
    "watch": "--for --once --contract --fail-on --record --keep --json --print-environment @ watch_test.py",
    "check": "",
    "completion": "",
}
# The same for runs in real time: their measured values always differ, so that only what follows from
# the options counts.
LIVE_EFFECTS = {
    "run --executor rm-ro --load 1 --transport intra_process --duration 0.1 --warm-up 0 --output out": LIVE,
    "compare --executors rm-ro --load 1 --transport intra_process --duration 0.1 --warm-up 0 --output out"
    " --repetitions 1": """
--executors default,rm-ro
--deployments isolated
--against --junit --markdown @ sweep_test.py
""",
}

# Every option that writes: a command line that ends in the option. The first file option of
# hotpath and of its Python package, and the first folder option, meet every kind of target; the
# others, which call the same functions, one or two.
FILES = """
summarize {stock}/run --responses
machine --duration 0.01 --output
analyze timers_only_60 --executors rm-ro --csv
analyze timers_only_60 --executors rm-ro --contract
timeline {stock}/run --csv
timeline {stock}/run --perfetto
"""
FILES_OF_PYTHON = """
compare-results {stock}/run {stock}/run --csv
compare-results {stock}/run {stock}/run --gate --junit
compare-results {stock}/run {stock}/run --gate --markdown
timeline {stock}/run --to 30 --svg
"""
FILES_OF_LONG_RUNS = f"""
compare --against hotpath {LONG} --junit
compare --against hotpath {LONG} --markdown
"""
# The same for folders | the file that marks a folder as replaceable by the same command.
FOLDERS = f"""
simulate {LONG} --output
run {LONG} --output
compare {LONG} --output
sweep {{stock}}/long.yaml --output | sweep.json
capacity {LONG} --output
validate {{stock}}/run --output
analyze timers_only_60 --page | bounds.json
analyze timers_only_60 --phases creation --witness
experiment wcrt-table --output | wcrt_table.csv
experiment waters --sets 1000000 --output | waters.csv
bench --output
report {{stock}}/run --output | report.html
compare-results {{stock}}/run {{stock}}/run --page | report.html
advise {LONG} --output
import ctf {{stock}}/ctf/rm-ro-0 --output
export ctf {{stock}}/run --output
watch --once true --record
"""
# Their folder is replaced, in a few seconds.
REPLACES = """
analyze timers_only_60 --executors rm-ro --page | bounds.json
experiment wcrt-table --output | wcrt_table.csv
experiment waters --sets 1 --utilisations 0.5 --paper-only --output | waters.csv
"""
# Options that take a file or folder to read.
INPUTS = {"--against", "--deployment", "--golden", "--phases-file", "--reference", "--ros2-runner"}
READ = {("watch", "--contract")}  # an output of another command

# By file of test_inputs.py: the commands that read it. {f} is the file, {d} its folder,
# {o} an option for a new one. The first command meets every damage; the others, which call the same reader, three.
READERS = """
run/run.json | summarize {d} | check {d} | explain {d} | recover {d} | export ctf {d} {o} | validate {d} {o}
run/jobs.csv | summarize {d} | check {d} | explain {d} | export ctf {d} {o}
run/chains.csv | summarize {d} | explain {d}
graph.yaml | graph {f} | simulate --graph {f} --duration 1 {o} | analyze {f} | advise {f} --draws 1 --duration 1 {o}
times.csv | graph {d}/callbacks.yaml
imported/deployment.yaml | simulate --graph {d}/graph.yaml --deployments {f} {o}
cie.yaml | simulate --graph sequences --deployments cie:{f} {o}
phases.csv | simulate --graph sequences --executors default --phases-file {f} {o}
order.txt | simulate --graph sequences --executors default --entity-order {f} {o}
golden.csv | summarize --golden {f} | simulate --graph timers_only_60 --phases-file {f} {o}
sweep.yaml | sweep {f} {o}
swept/sweep.json | sweep {d}/../sweep.yaml --output {d}
swept/sweep.yaml | sweep {d}/../sweep.yaml --output {d}
reference/rclcpp_timers_only.csv | validate --reference {d} {o}
reference/rclcpp_autoware_phases.csv | validate --reference {d} {o}
ctf/rm-ro-0/metadata | import ctf {d} {o}
ctf/rm-ro-0/stream | import ctf {d} {o}
"""
# The same for the Python package, which runs in the test's process: a start takes a second.
PYTHON_READERS = """
run/run.json | report {d} {o} | timeline {d} | compare-results {d} {d} | hot-path {d} {o}
run/summary.json | report {d} {o} | timers-only {d} {o} | compare-results {d} {d} --gate
run/chains.csv | hot-path {d} {o} | report {d} {o}
run/jobs.csv | timeline {d}
bench/bench.json | bench-report {d} | bench --compare {d}
swept/table.csv | sweep {d}
capacity/levels.csv | capacity {d}
advice/advice.json | advice {d}
bounds/bounds.json | guarantees {d}
bounds/bounds.csv | guarantees {d}
validation/validation.json | validate {d}
"""

# Command lines in which NAME is a name with control sequences and markup.
NAMED = """
NAME | graph NAME | simulate --graph NAME | simulate --executors NAME | simulate --deployments NAME
simulate --phases-file NAME | simulate --load NAME | simulate --entity-order NAME | --NAME | check NAME
summarize NAME | sweep NAME | summarize --golden NAME | recover NAME | compare-results NAME NAME
timeline NAME | bench --compare NAME NAME | bench --only NAME | validate NAME | import ctf NAME | export ctf NAME
advise NAME | advise --for NAME | analyze NAME | analyze --trace NAME | capacity --require NAME
capacity --executors NAME | explain NAME | explain LINES NAME
"""
# Of a run with such names, at {run} | exit code | a part of what it prints.
NAMED_RUN = """
summarize {run} | 0 | script
check {run} | 0 |
explain {run} | 2 | its tasks are not
validate {run} --output v | 2 | has no task
report {run} --output page | 0 |
timeline {run} --from 1000 --to 1100 --svg chart.svg --perfetto chart.json | 0 |
compare-results {run} {run} --gate --junit gate.xml --markdown gate.md --page gate | 0 |
"""
NAMED_CAPACITY = (
    "capacity --graph sequences --executors rm-ro --from 20 --to 20 --duration 1 --require no-loss"
    " --output capacity"
)

# Commands that start Python, in a folder of hostile modules; {run} is a run.
STARTS_PYTHON = """
simulate --graph sequences --duration 2 --executors default,rm-ro --output made
report {run}
"""
REPORT = "report {stock}/run"
PRINT_GRAPH = ("graph {graph}", "graph {graph} --dot")
LIST_GRAPHS = ("list", "graphs")
IMPORT = ("import", "ctf")
EXPLAIN_WORST = "explain --worst"
NAMED_RUN_OF_THE_PACKAGE = ("report {run}", "compare-results {run} {run}")
INTO_EMPTY = ("simulate --duration 0.1 --warm-up 0 --output", "export ctf {stock}/run --output")


def as_the_program_starts_it(line: list[str], folder: Path) -> list[str]:
    """The words of a command line as hotpath gives them to its Python package."""
    if line[0] == "timeline":
        options = {"run": line[1], "executors": [], "chains": [], "repetition": 0, "from_ms": 0, "to_ms": 900}
        return ["timeline", json.dumps({**options, "svg": "", "perfetto": str(folder / "t.json")})]
    if line[0] == "bench":
        return ["bench", json.dumps({"compare": [line[2], line[2]]})]
    return line


# Faults during a run.
CPU_TIMES = {  # more words, whether rows have CPU times
    "--phases synchronous": True,
    "--phases synchronous --load 0": False,
    "--phases synchronous --work fixed": False,
    "--phases synchronous --work fixed --cpu-time": True,
}
# The limit of adverse_runs_test.py | words | parts of the sentence.
FAILS = """
no priority | run {brief} --timer-policy fifo:50 --output run | fifo:50 | refused
no locked memory | run {brief} --lock-memory --output run | locking memory was refused
12 files | run --duration 0.2 --warm-up 0 --output run | cannot be set up | Too many open files
20 kB | simulate --executors default --duration 20 --output run | jobs.csv.part | File too large
"""
FULL_DISK = """
run {brief} --output disk/run | No space left | not complete
export ctf long --output disk/trace | disk is full
"""
TWENTY_SECONDS = "simulate --executors default --duration 20 --output long"
WITHOUT_FIGURE = "run --load 1 --duration 1 --warm-up 0 --output run"
WITHOUT_NETWORK = "run --processes 2 --time-out 1 --output run"
FEW_FILES = (
    "simulate --load 1 --duration 0.2 --warm-up 0",
    "run --load 1 --duration 0.2 --warm-up 0 --time-out 5",
)
TWO_PROCESSES = "run --processes 2 --network shared_memory --warm-up 0"
TWO_EXECUTORS = "compare --executors rm-ro,default --repetitions 1 --transport intra_process --warm-up 0"
SHORT_RUNS = (
    "compare --executors default,rm-ro --repetitions 2 --processes 2 --network shared_memory"
    " --load 1 --duration 0.2 --warm-up 0 --time-out 1"
)
LIVE_RUN = "run --live --processes 2 --load 5 --duration 2 --warm-up 0"
FOUR_RUNS = "compare --executors default,rm-ro --repetitions 2 --load 5 --duration 1.5 --warm-up 0"
TOO_LONG = ("simulate --duration 40000", "run --transport intra_process --duration 5000")
RECOVER = ("recover", "run")
# Command lines whose results, in the folder `disk`, survive a power loss.
SURVIVE = """
simulate --executors default,rm-ro --duration 0.5 --warm-up 0 --output disk/a/run
run {brief} --output disk/run
summarize disk/run0 --responses disk/responses.csv | export ctf disk/run0 --output disk/new/trace
sweep {stock}/short.yaml --threads 1 --output disk/sweep
"""
