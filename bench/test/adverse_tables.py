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
    return line.format(stock=stock, reference=REFERENCE, brief=BRIEF, one=ONE, **places).split()


ONE = "--executors rm-ro --repetitions 1"  # of `run`, whose default is all of the paper's
BRIEF = f"{ONE} --transport intra_process --load 5 --duration 0.2 --warm-up 0"
LONG = "--duration 3000"

# Rows of printed JSON have the names of the stored files: command line, fields of one row.
JSON_HOLDS: dict[str, dict[str, Any]] = {
    "analyze timers_only_60 --executors rm-ro": {"kind": "task", "name": "FrontCamera", "observed_ns": None},
    "list graphs": {"name": "autoware"},
    "list deployments": {"name": "isolated"},
    "paper table1": {"task": "Camera"},
    "diff {stock}/run {stock}/run --gate": {"worse": False},
}
SUMMARISED = "simulate --executors rm-ro --duration 1"

# Words that are rejected before anything happens | parts of the one sentence.
REJECTED = """
| a command is missing; available: run, bench
rum | `rum` | did you mean `run`?
run --fast | --fast | hotpath run --help
run --duration soon | --duration | `soon` | 0.1
run --repetitions 2.5 | --repetitions | `2.5` | whole number
run --transport tcp | --transport | tcp | fastdds,intra_process
run --domain 233 | --domain | 0 to 232
run --cpus 4000 | --cpus | may not use processor 4000
run --cpus 1- | --cpus | `1-`
run --timer-policy fifo | `fifo` | fifo:N
run --processes 2 --transport intra_process | --processes | fastdds
run --processes 25 | --processes | 24 nodes
run --phases given | --phases given | phase_ms
run --graph autowear | autowear | autoware
run --graph ./absent.yaml | absent.yaml | cannot be read (No such file
run --graph {stock} | {stock}
run --graph {stock}/period.yaml | period.yaml:3 | period
graph {stock}/open.yaml | open.yaml:
run --stack ros | --stack | native
run {brief} --output /proc/x | /proc/x | --output
import ctf nowhere | cannot be read (No such file
import ctf {stock}/advice | holds no CTF trace
import ctf {stock}/json_ctf | ctf-1.8
import ctf {stock}/text_ctf | is not CTF
import ctf {stock}/ctf/rm-ro-0 --chain A | is not SOURCE
import ctf {stock}/ctf/rm-ro-0 --chain nobody:nothing | is not a node or task
import ctf {stock}/ctf/rm-ro-0 --deployments {stock}/nobody.yaml --output new | Nobody
run --quick --duration 5 | --quick | --duration
run --quick --repetitions 5 | --quick | --repetitions
run autoware --graph sequences | --graph
run --transport intra_process --network shared_memory | --transport | --network
run --transport intra_process --domain 3 | --transport | --domain
run --transport intra_process --all-interfaces | --transport | --all-interfaces
run --rmw cyclonedds | --rmw | --stack
analyze autoware --trace x --rate 50 | --trace | --rate
analyze autoware --trace x --copies 2 | --trace | --copies
analyze autoware --trace x --entity-order reverse | --trace | --entity-order
bench --quick --repetitions 3 | --quick | --repetitions
run --against x --json | --against | --json
explain run --worst --sequence 3 | --worst | --sequence
explain {stock}/timers --executors static | no executor static
explain {stock}/run --executors rm-ro,rm-ro | the same
explain {stock}/autoware --executors rm-ro --chain hot | hot_path
explain {stock}/autoware --executors rm-ro --task RearLidar | RearLidarDriver
explain {stock}/autoware --executors rm-ro --sequence 100000 | --sequence
explain {stock}/autoware --executors rm-ro --repetition 7 | repetition 7
explain {stock}/run {stock}/autoware | different tasks
explain run run --worst | --worst
export perfetto {stock}/timers --from 5 --to 4 --output x | --to must lie after --from
replay {stock}/tiny --executors best | best | rm-ro (repetition 0)
replay {stock}/tiny --repetition 1 | repetition 1 | rm-ro (repetition 0)
replay {stock}/tiny --from 5 | after the end of the run
replay {stock}/tiny --speed 0 | --speed
replay {stock}/tiny --graph sequences | no task | another graph
simulate --cores 0 | --cores | from 1 to 64
simulate --platform release_cost_us=-1 | --platform | release_cost_us
simulate --platform cost=1 | --platform | release_cost_us
simulate --duration 1e12 | --duration | from 0.1 to 1e+09
simulate --duration 1e9 | --duration | memory | --no-trace
simulate --execution-times best | --execution-times | worst, uniform
simulate --executors rm-or | rm-or | rm-ro
simulate --graph {stock}/tiny.yaml --phases {stock}/phases.csv | phases.csv:2
simulate --executors rm-ro --execution-times replay:{stock}/timers | jobs.csv: | another graph
simulate --executors rm-ro --phases {stock}/timers | --phases | another graph
simulate --graph timers_only_60 --executors edf-ro --execution-times replay:{stock}/timers | edf-ro (repetition 0)
capacity --require fast | --require: `fast`
simulate --deployments a,,b | --deployments: `a,,b` has an empty item
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
simulat | simulate
run --executers rm-ro | --executors
timeline | `timeline` is | export perfetto RUN
validate | `validate` is | `diff RUN --simulated`
"""
# Numbers are read strictly: words | values that are not whole numbers of the range.
NUMBERS = {
    "simulate --seed": "-1 +1 0x10 1e3 18446744073709551616 1.0",
    "paper waters --threads": "-1 1025",
}
# ROS 2's stack rejects what it would ignore; $ROS_DISTRO | words | parts of the sentence.
ROS2_RUN = f"run --stack rclcpp {BRIEF}"
ON_ROS2 = "run --stack rclcpp --repetitions 1 --duration 1"
REJECTED_ON_ROS2 = """
| --copies 2 | --stack rclcpp | leave | --copies
| --rate 50 | --stack rclcpp | leave | --rate
| --processes 2 | --stack rclcpp | leave | --processes
| --transport intra_process | --stack rclcpp | leave | --transport
| --entity-order reverse | --stack rclcpp | leave | --entity-order
| --rmw nonsense | --rmw nonsense | rmw_nonsense_cpp
| --executors events-ro --timer-policy other | events-ro@rclcpp | --executor-policy
| --executors multi-fair | multi-fair@rclcpp | rclcpp has no such executor | static
kilted | --executors static | static@rclcpp | ROS 2 kilted | events-re
humble | --executors events-re | events-re@rclcpp | ROS 2 humble | static, multi, rm-ro
"""
# An option that changes nothing for this executor: a note says so.
NOTED = "simulate --duration 1 --output out --executors rm-ro --entity-order reverse"

# Every option that writes: a command line that ends in the option. The first file option of
# hotpath and of its Python package, and the first folder option, meet every kind of target; the
# others, which call the same functions, one or two.
FILES = """
export perfetto {stock}/run --to 30 --output
doctor --duration 0.01 --output
analyze timers_only_60 --executors rm-ro --csv
analyze timers_only_60 --executors rm-ro --contract
"""
FILES_OF_PYTHON = """
diff {stock}/run {stock}/run --csv
diff {stock}/run {stock}/run --gate --junit
diff {stock}/run {stock}/run --gate --markdown
"""
FILES_OF_LONG_RUNS = f"""
run --against hotpath {LONG} --junit
run --against hotpath {LONG} --markdown
"""
# The same for folders | the file that marks a folder as replaceable by the same command.
FOLDERS = f"""
simulate {LONG} --output
run {LONG} --output
sweep {{stock}}/long.yaml --output | sweep.json
capacity {LONG} --output
diff {{stock}}/run --simulated --output
analyze timers_only_60 --phases creation --witness
paper table1 --output | wcrt_table.csv
paper waters --sets 1000000 --output | waters.csv
paper golden --output
bench --output
report {{stock}}/run --output | report.html
diff {{stock}}/run {{stock}}/run --page | report.html
advise {LONG} --output
import ctf {{stock}}/ctf/rm-ro-0 --output
export ctf {{stock}}/run --output
watch --once true --record
"""
# Their folder is replaced, in a few seconds.
REPLACES = """
paper table1 --output | wcrt_table.csv
paper waters --sets 1 --output | waters.csv
"""
# Options that take a file or folder to read, and options that a table names elsewhere.
INPUTS = {"--against", "--deployments", "--phases"}
ELSEWHERE = {("watch", "--contract"), ("paper", "figures", "--output")}

# By file of test_inputs.py: the commands that read it. {f} is the file, {d} its folder,
# {o} an option for a new one. The first command meets every damage; the others, which call the same reader, three.
READERS = """
run/run.json | report {d} --summary | doctor {d} | explain {d} | doctor {d} --recover | export ctf {d} {o}
run/run.json | diff {d} --simulated {o} | diff {d} {d}
run/summary.json | diff {d} {d} --gate
bench/bench.json | diff {d} {d}
run/jobs.csv | report {d} --summary | doctor {d} | explain {d} | export perfetto {d} {o}
run/chains.csv | report {d} --summary | explain {d} | diff {d} {d}
graph.yaml | graph {f} | simulate {f} --duration 1 {o} | analyze {f}
graph.yaml | advise {f} --repetitions 1 --duration 1 {o}
times.csv | graph {d}/callbacks.yaml
imported/deployment.yaml | simulate {d}/graph.yaml --deployments {f} {o}
cie.yaml | simulate sequences --deployments cie:{f} {o}
phases.csv | simulate sequences --executors default --phases {f} {o}
order.txt | simulate sequences --executors default --entity-order {f} {o}
golden.csv | simulate timers_only_60 --phases {f} {o}
sweep.yaml | sweep {f} {o}
swept/sweep.json | sweep {d}/../sweep.yaml --output {d}
swept/sweep.yaml | sweep {d}/../sweep.yaml --output {d}
reference/rclcpp_timers_only.csv | paper golden {d} {o}
reference/rclcpp_autoware_phases.csv | paper golden {d} {o}
ctf/rm-ro-0/metadata | import ctf {d} {o}
ctf/rm-ro-0/stream | import ctf {d} {o}
"""
# The same for the Python package, which runs in the test's process: a start takes a second.
PYTHON_READERS = """
run/run.json | report {d} {o} | hot-path {d}
run/summary.json | report {d} {o}
run/chains.csv | hot-path {d} | report {d} {o}
bench/bench.json | bench-report {d}
swept/table.csv | sweep {d}
capacity/levels.csv | capacity {d}
advice/advice.json | advice {d}
validation/validation.json | validate {d}
"""

# Command lines in which NAME is a name with control sequences and markup.
NAMED = """
NAME | graph NAME | simulate NAME | simulate --executors NAME | simulate --deployments NAME | --NAME
simulate --phases NAME | simulate --load NAME | simulate --platform NAME=1 | simulate --entity-order NAME
doctor NAME | report NAME | report NAME --summary | sweep NAME | paper golden NAME | doctor NAME --recover
diff NAME NAME | diff NAME --simulated | bench --only NAME
import ctf NAME | export ctf NAME --output x | export perfetto NAME --output x
advise NAME | advise --for NAME | analyze NAME | analyze autoware --trace NAME | capacity --require NAME
capacity --executors NAME | explain NAME | explain LINES NAME
"""
# Of a run with such names, at {run} | exit code | a part of what it prints.
NAMED_RUN = """
report {run} --summary | 0 | script
doctor {run} | 0 |
explain {run} | 2 | its tasks are not
diff {run} --simulated --output v | 2 | has no task
report {run} --output page | 0 |
export perfetto {run} --from 1000 --to 1100 --output chart.json | 0 |
diff {run} {run} | 0 |
diff {run} {run} --gate --junit gate.xml --markdown gate.md --page gate | 0 |
"""

# Commands that start Python, in a folder of hostile modules; {run} is a run.
STARTS_PYTHON = """
simulate sequences --duration 2 --executors default,rm-ro --output made
report {run}
"""
REPORT = "report {stock}/run"
PRINT_GRAPH = ("graph {graph}", "graph {graph} --as dot")
LIST_GRAPHS = ("list", "graphs")
IMPORT = ("import", "ctf")
EXPLAIN_WORST = "explain --worst"
NAMED_RUN_OF_THE_PACKAGE = ("report {run}",)
INTO_EMPTY = ("simulate --duration 0.1 --warm-up 0 --output", "export ctf {stock}/run --output")


def as_the_program_starts_it(line: list[str]) -> list[str]:
    """The words of a command line as hotpath gives them to its Python package."""
    if line[0] == "bench":
        return ["bench", json.dumps({"compare": [line[2], line[2]]})]
    return line


# Faults during a run.
# The limit of adverse_runs_test.py | words | parts of the sentence.
FAILS = """
no priority | run {brief} --timer-policy fifo:50 --output run | fifo:50 | refused
no locked memory | run {brief} --lock-memory --output run | locking memory was refused
12 files | run {one} --duration 0.2 --warm-up 0 --output run | cannot be set up | Too many open files
20 kB | simulate --executors default --duration 20 --output run | jobs.csv.part | File too large
"""
FULL_DISK = """
run {brief} --output disk/run | No space left | not complete
export ctf long --output disk/trace | disk is full
"""
TWENTY_SECONDS = "simulate --executors default --duration 20 --output long"
WITHOUT_FIGURE = f"run {ONE} --load 1 --duration 1 --warm-up 0 --output run"
WITHOUT_NETWORK = f"run {ONE} --processes 2 --time-out 1 --output run"
FEW_FILES = (
    "simulate --load 1 --duration 0.2 --warm-up 0",
    f"run {ONE} --load 1 --duration 0.2 --warm-up 0 --time-out 5",
)
TWO_PROCESSES = f"run {ONE} --processes 2 --network shared_memory --warm-up 0"
TWO_EXECUTORS = "run --executors rm-ro,default --repetitions 1 --transport intra_process --warm-up 0"
SHORT_RUNS = (
    "run --executors default,rm-ro --repetitions 2 --processes 2 --network shared_memory"
    " --load 1 --duration 0.2 --warm-up 0 --time-out 1"
)
LIVE_RUN = f"run {ONE} --live --processes 2 --load 5 --duration 2 --warm-up 0"
FOUR_RUNS = "run --executors default,rm-ro --repetitions 2 --load 5 --duration 1.5 --warm-up 0"
RECOVER = ("doctor", "run", "--recover")
# Command lines whose results, in the folder `disk`, survive a power loss.
SURVIVE = """
simulate --executors default,rm-ro --duration 0.5 --warm-up 0 --output disk/a/run
run {brief} --output disk/run
report disk/run0 --summary | export ctf disk/run0 --output disk/new/trace
sweep {stock}/short.yaml --threads 1 --output disk/sweep
"""
