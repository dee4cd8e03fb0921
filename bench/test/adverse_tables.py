# SPDX-License-Identifier: Apache-2.0
"""The command lines of the tests that misuse commands, and what must come of each. A row is a line of a
table, with cells between `|`. `{stock}` is the folder of test_inputs.py, the other names in braces are
PLACES. "Given" is shell code before the command; `nobody` runs it as another user."""

from pathlib import Path
from typing import Any

ONE = "--executors rm-ro --repetitions 1"  # of `run`, whose default is all of the paper's
PLACES: dict[str, Any] = {
    "one": ONE,
    "brief": f"{ONE} --transport intra_process --load 5 --duration 0.2 --warm-up 0",
    "short": "--duration 1 --warm-up 0",
    "ros2": "AMENT_PREFIX_PATH=/no/where HOTPATH_ROS2_RUNNER=/bin/true run --stack rclcpp --duration 1",
    "two_processes": f"run {ONE} --processes 2 --network shared_memory --warm-up 0 --output run --duration",
    "two_executors": "run --executors rm-ro,default --repetitions 1 --transport intra_process --warm-up 0"
    " --output run --duration",
    "reference": Path(__file__).resolve().parents[2] / "reference_system" / "ros2_reference",
}


def rows(table: str, columns: int = 0) -> list[list[str]]:
    """The rows of a table, filled to this number of columns."""
    found = [[cell.strip() for cell in line.split("|")] for line in table.strip("\n").splitlines()]
    return [row + [""] * (columns - len(row)) for row in found]


# Words that are rejected before anything happens | parts of the one sentence.
REJECTED = """
| a command is missing; available: run, bench
rum | `rum` | did you mean `run`?
simulat | simulate
import {stock} | write `hotpath import ctf
import ctf {stock}/tiny.yaml | is not a folder; unpack an archive
run --fast | --fast | hotpath run --help
run --executer rm-ro | did you mean `--executors`?
explain {stock}/run --executor rm-ro | did you mean `--executors`?
run --domain 233 | --domain | 0 to 232
run --transport fastdd | fastdds,intra_process | did you mean `fastdds`?
run --graph autowear | did you mean `autoware`?
run --executors rm-rp | `rm-rp` | did you mean `rm-r
simulate --phases synchronus | did you mean `synchronous`?
simulate --set FrontLidarDriver=3 | --set FrontLidarDriver=3 | NODE.KEY=VALUE
simulate --set FrontLidar.period_ms=3 | no node FrontLidar | FrontLidarDriver
simulate --set FrontLidarDriver.perod_ms=3 | --set FrontLidarDriver.perod_ms=3 | did you mean `period_ms`?
simulate --set FrontLidarDriver.period_ms=0 | --set FrontLidarDriver.period_ms=0 | `period_ms` | is 0
graph | GRAPH is missing | hotpath graph --help
graph --new {stock}/tiny.yaml | --new | exists
graph --new robot | --new | .yaml
run --cpus 4000 | --cpus | may not use processor 4000
run --cpus 1- | --cpus | `1-`
run --timer-policy fifo | `fifo` | fifo:N
run --processes 2 --transport intra_process | --processes | fastdds
run --processes 25 | --processes | 24 nodes
run --phases given | --phases given | phase_ms
run --graph ./absent.yaml | absent.yaml | cannot be read (No such file
run autoware --graph sequences | --graph
run --rmw cyclonedds | --rmw | --stack
run --stack rclcpp {brief} | setup.bash | ros2_build.sh
AMENT_PREFIX_PATH=/no/where run --stack rclcpp {brief} | hotpath_rclcpp_system
AMENT_PREFIX_PATH=/ HOTPATH_ROS2_RUNNER=/no/where run --stack rclcpp {brief} | no executable program /no/where
{ros2} --copies 2 | --stack rclcpp | leave | --copies
{ros2} --rate 50 | --stack rclcpp | leave | --rate
{ros2} --set FrontLidarDriver.period_ms=50 | --stack rclcpp | leave | --set
{ros2} --processes 2 | --stack rclcpp | leave | --processes
{ros2} --transport intra_process | --stack rclcpp | leave | --transport
{ros2} --entity-order reverse | --stack rclcpp | leave | --entity-order
{ros2} --rmw nonsense | --rmw nonsense | rmw_nonsense_cpp
{ros2} --executors events-ro --timer-policy other | events-ro@rclcpp | --executor-policy
{ros2} --executors multi-fair | multi-fair@rclcpp | rclcpp has no such executor | static
ROS_DISTRO=kilted {ros2} --executors static | static@rclcpp | ROS 2 kilted | events-re
ROS_DISTRO=humble {ros2} --executors events-re | events-re@rclcpp | ROS 2 humble | static, multi, rm-ro
run {brief} --output /proc/x | /proc/x | --output
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
replay {stock}/tiny --rate 0 | --rate
replay {stock}/tiny --graph sequences | no task | another graph
simulate --cores 0 | --cores | from 1 to 64
simulate --platform release_cost_us=-1 | --platform | release_cost_us
simulate --platform cost=1 | --platform | release_cost_us
simulate --duration 1e12 | --duration | from 0.1 to 1e+09
simulate --duration 1e9 | --duration | memory | --no-trace
simulate --execution-times best | --execution-times | worst, uniform
simulate --executors , | --executors: `,` has an empty item
simulate --deployments a,,b | --deployments: `a,,b` has an empty item
simulate --graph {stock}/tiny.yaml --phases {stock}/phases.csv | phases.csv:2
simulate --executors rm-ro --execution-times replay:{stock}/timers | jobs.csv: | another graph
simulate --executors rm-ro --phases {stock}/timers | --phases | another graph
simulate --graph timers_only_60 --executors edf-ro --execution-times replay:{stock}/timers | edf-ro (repetition 0)
capacity --require fast | --require: `fast`
capacity --over copies --from 0.5 | whole numbers
capacity --from 9 --to 5 | --from is greater than --to
capacity --over copies --from 1 --to 2000 | --over | --copies | 1000
capacity --over rate --from 0 | --over | --rate
"""
# Options that exclude each other: a command line that ends in one | those that it rejects.
EXCLUDED = """
run --quick | --duration 5 | --repetitions 5
run --transport intra_process | --network shared_memory | --domain 3 | --all-interfaces
run --against x | --json
sweep --new new.yaml | --threads 2 | --yes | --output x
graph --new new.yaml | --graph autoware | --set A.b=1 | --as dot | --deployments isolated
analyze autoware --trace x | --set A.b=1 | --rate 50 | --copies 2 | --entity-order reverse
bench --quick | --repetitions 3
explain run --worst | --sequence 3
explain run --chain a | --task b
capacity --over load | --load 50
"""
# Values that options of a kind reject; the kinds are those of --help.
WHOLE_NUMBERS = "-1 +1 0x10 1e3 18446744073709551616 1.0 soon"
OTHER_NUMBERS = "soon -1 1e300"

# Every option that writes: a command line that ends in the option.
FILES = """
export perfetto {stock}/run --to 30 --output
doctor --duration 0.01 --output
analyze timers_only_60 --executors rm-ro --csv
analyze timers_only_60 --executors rm-ro --contract
diff {stock}/run {stock}/run --csv
diff {stock}/run {stock}/run --gate --junit
diff {stock}/run {stock}/run --gate --markdown
"""
FILES_OF_LONG_RUNS = """
run --against hotpath --duration 3000 --junit
run --against hotpath --duration 3000 --markdown
"""
# The same for folders | the file that marks a folder as replaceable by the same command.
FOLDERS = """
simulate --duration 3000 --output
run --duration 3000 --output
sweep {stock}/long.yaml --output | sweep.json
capacity --duration 3000 --output
diff {stock}/run --simulated --output
analyze timers_only_60 --phases creation --witness
paper table1 --output | wcrt_table.csv
paper waters --sets 1000000 --output | waters.csv
paper golden --output
paper threads --output
bench --output
report {stock}/run --output | report.html
diff {stock}/run {stock}/run --output | report.html
advise --duration 3000 --output
import ctf {stock}/ctf/rm-ro-0 --output
export ctf {stock}/run --output
watch --once true --output
"""
# Options that take a file or folder to read, and those whose targets are tested elsewhere.
INPUTS = {"--against", "--deployments", "--phases"}
ELSEWHERE: set[tuple[str, ...]] = {("graph", "--new"), ("sweep", "--new"), ("watch", "--contract")}
ELSEWHERE |= {("paper", "figures", "--output")}

# Shell code for a folder, and the targets in it that are refused: given | targets.
CROWDED = (
    "mkdir folder theirs closed; touch file; ln -s loop loop; ln -s nowhere dangling; ln -s theirs link;"
    " echo years of work >theirs/thesis.tex; echo old >old; chmod 444 old; echo old >closed/old;"
    " chmod 666 closed/old; chmod 555 closed;"
)
REFUSED_FILES = """
| folder missing/out file/out file/below/out loop
nobody | old closed/old closed/new
"""
REFUSED_FOLDERS = """
| file file/below file/far/below theirs theirs/ link dangling /dev/full /dev/full/below
nobody | closed closed/far/below
"""
# Targets that are taken: shell code | the target | the file or folder that is written, and nothing else is.
TAKEN_FILES = """
| out | out
echo old >out; chmod 664 out | out | out
mkfifo out; touch copy; timeout 60 cat out >copy & | out | copy
mknod -m 666 out c 1 3 && : >out | out |
{links} | out | there/file
{links}; echo old >there/file | out | there/file
"""
# A link to a link. Beside both are the user's own FILE.part, and links with names that a writer might use
# for temporary files.
LINKS = (
    "mkdir there; ln -s middle out; ln -s there/file middle; echo years of work >precious;"
    " for at in ./out there/file; do echo mine >$at.part; for other in $at.tmp $at.new $at~"
    " ${at%/*}/.${at##*/}.part; do ln -s $PWD/precious $other; done; done"
)
TAKEN_FOLDERS = """
paper table1 --output | mkdir out; touch out/wcrt_table.csv | out | out
paper waters --sets 1 --output | mkdir out; touch out/waters.csv | out | out
simulate --duration 0.1 --warm-up 0 --output | {beside} | empty | empty
simulate --duration 0.1 --warm-up 0 --output | {beside} | link | empty
export ctf {stock}/run --output | {beside} | empty | empty
export ctf {stock}/run --output | {beside} | link | empty
"""
BESIDE = "mkdir empty empty.part; ln -s empty link; echo years of work >empty.part/thesis.tex"

# By file of test_inputs.py: the commands that read it. {f} is the file, {d} its folder,
# {o} an option for a new one. The first command meets every damage; the others, which call the same
# reader, three.
READERS = """
run/run.json | report {d} --summary | doctor {d} | explain {d} | doctor {d} --recover | export ctf {d} {o}
run/run.json | diff {d} --simulated {o} | diff {d} {d} | simulate autoware --phases {d} {o}
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
READERS_OF_THE_PACKAGE = """
run/run.json | report {d} {o} | hot-path {d}
run/summary.json | report {d} {o}
run/chains.csv | hot-path {d} | report {d} {o}
bench/bench.json | bench-report {d}
swept/sweep.json | sweep {d}
capacity/capacity.json | capacity {d}
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
# Of a run with such names | exit code | a part of what it prints.
NAMED_RUN = """
report run --summary | 0 | script
doctor run | 0 |
explain run | 2 | its tasks are not
diff run --simulated --output v | 2 | has no task
report run --output page | 0 |
export perfetto run --from 1000 --to 1100 --output chart.json | 0 |
diff run run | 0 |
diff run run --gate --junit gate.xml --markdown gate.md --output gate | 0 |
"""

# What this machine or this user refuses: given | words | parts of the sentence.
FAILS = """
nobody | run {brief} --timer-policy fifo:50 --output run | fifo:50 | refused
ulimit -l 0; nobody | run {brief} --lock-memory --output run | locking memory was refused
ulimit -n 8; | run {one} --duration 0.2 --warm-up 0 --output run | socket pair: Too many open files
ulimit -n 12; | run {one} --duration 0.2 --warm-up 0 --output run | cannot be set up | Too many open files
ulimit -f 40; | simulate --executors default --duration 20 --output run | jobs.csv.part | File too large
timeout -s INT 2 "$@"; exit 1; | simulate --duration 1e6 --no-trace --output run | interrupted | nothing was
ulimit -s 64; | report {stock}/run | ulimit -s
unshare -n | run {one} --processes 2 --time-out 1 --output run | DDS domain 0 | partners
"""
# With a run that is whole: given | options | exit code | text on standard error | in run.json.
WHOLE_ANYWAY = """
nobody | {brief} | 0 | note: SCHED_FIFO was not permitted | SCHED_FIFO | executor other, timer_mgmt other
ulimit -n 40; | {one} --load 1 --duration 0.2 --warm-up 0 | 0 |
exec <&- >&- 2>&-; | {brief} | 0 |
>/dev/full | {brief} | 1 | standard output
HOTPATH_FIGURES= MPLBACKEND=none | {one} --load 1 --duration 1 --warm-up 0 | 0 | note: the figure was not drawn
{stepped}=3600 | {one} --live --processes 2 --load 5 --duration 2 --warm-up 0 | 0 |
{stepped}=-3600 | {one} --live --processes 2 --load 5 --duration 2 --warm-up 0 | 0 |
"""
FULL_DISK = """
run {brief} --output disk/run | No space left | not complete
export ctf long --output disk/trace | disk is full
"""
# Runs that a signal hits: words | signal | its receiver: a child, all, or the command | exit code |
# processes whose jobs are stored | what is said.
HIT = """
{two_processes} 1.5 --time-out 1 | KILL | 1 | 1 | | process 2 of 2 | Killed
{two_processes} 1.5 --time-out 1 | STOP | 0 | 1 | | process 1 of 2 | did not answer in time | --time-out
{two_executors} 0.8 | KILL | 0 | 1 | 0 | 1 of 2 runs failed
{two_processes} 30 | INT | all | 130 | 0 1 | partial
{two_executors} 30 | TERM | command | 143 | 0 | partial
{two_processes} 30 | KILL | command | -9 |
"""
SHORT_RUNS = (
    "run --executors default,rm-ro --repetitions 2 --processes 2 --network shared_memory"
    " --load 1 --duration 0.2 --warm-up 0 --time-out 1 --output"
)
