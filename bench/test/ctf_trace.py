# SPDX-License-Identifier: Apache-2.0
"""Writes traces of small systems with ros2_tracing events byte by byte (CTF 1.8), so that a test
can plant any fault of a recording."""

import struct
from pathlib import Path
from typing import Any

METADATA = """/* CTF 1.8 */
typealias integer { size = 32; align = 8; signed = false; } := u32;
typealias integer { size = 64; align = 8; signed = false; } := u64;
trace { major = 1; minor = 8; byte_order = le; packet.header := struct { u32 magic; u32 stream_id; }; };
clock { name = "monotonic"; freq = 1000000000; offset = 0; };
typealias integer { size = 64; align = 8; signed = false; map = clock.monotonic.value; } := stamp;
stream {
  id = 0;
  packet.context := struct {
    stamp timestamp_begin; stamp timestamp_end; u64 content_size; u64 packet_size; u64 events_discarded; u32 cpu_id;
  };
  event.header := struct { u32 id; stamp timestamp; };
  event.context := struct { u32 vpid; u32 vtid; string procname; };
};
"""
MAGIC = 0xC1FC1FC1
MS = 1_000_000


class CtfTrace:
    """A trace of one process whose nodes have timers and subscriptions. Times are in nanoseconds;
    addresses are invented unless given."""

    def __init__(self, initialised: bool = True) -> None:
        self.initialised = initialised  # whether events of initialisation are recorded
        self.events: list[Any] = []
        self.discarded = 0
        self.process, self.thread = 100, 100
        self.last_address = 0x1000

    def address(self) -> Any:
        self.last_address += 16
        return self.last_address

    def event(self, at: Any, name: str, **fields: Any) -> None:
        initialises = name.startswith(("rcl_", "rclcpp_")) and not name.endswith("publish")
        if self.initialised or not initialises:
            self.events.append((at, "ros2:" + name, self.process, self.thread, fields))

    def node(self, at: Any, name: str) -> Any:
        handle = self.address()
        self.event(at, "rcl_node_init", node_handle=handle, node_name=name, namespace="/")
        return handle

    def publisher(self, at: Any, node: Any, topic: str) -> Any:
        handle, of = self.address(), {"node_handle": node, "topic_name": topic, "queue_depth": 1}
        self.event(at, "rcl_publisher_init", publisher_handle=handle, **of)
        return handle

    def timer(self, at: Any, node: Any, period: Any, callback: Any = None) -> Any:
        handle, callback = self.address(), callback or self.address()
        self.event(at, "rcl_timer_init", timer_handle=handle, period=period)
        self.event(at, "rclcpp_timer_callback_added", timer_handle=handle, callback=callback)
        self.event(at, "rclcpp_timer_link_node", timer_handle=handle, node_handle=node)
        return callback

    def subscription(self, at: Any, node: Any, topic: str) -> tuple[Any, Any]:
        handle, rmw, rclcpp, callback = (self.address() for _ in range(4))
        of = {"node_handle": node, "rmw_subscription_handle": rmw, "topic_name": topic, "queue_depth": 1}
        self.event(at, "rcl_subscription_init", subscription_handle=handle, **of)
        self.event(at, "rclcpp_subscription_init", subscription_handle=handle, subscription=rclcpp)
        self.event(at, "rclcpp_subscription_callback_added", subscription=rclcpp, callback=callback)
        return rmw, callback

    def job(self, start: Any, end: Any, callback: Any, publishes: Any = None, takes: Any = None) -> Any:
        """Adds one run of a callback; `end` None: it never ends. `publishes`: a publisher; its
        message is stamped with the publication instant, just before the end. `takes`: a subscription's
        handle and the timestamp of the message it takes. Returns the publication instant."""
        if takes:
            rmw, stamp = takes
            self.event(start - 1000, "rmw_take", rmw_subscription_handle=rmw, source_timestamp=stamp, taken=1)
        self.event(start, "callback_start", callback=callback, is_intra_process=0)
        last = (start + 1000 if end is None else end) - 500
        if publishes:
            self.event(last, "rcl_publish", publisher_handle=publishes, message=1)
            self.event(last, "rmw_publish", message=1, timestamp=last)
        if end is not None:
            self.event(end, "callback_end", callback=callback)
        return last

    def write(self, folder: Path) -> Any:
        """Writes one stream with the events in the order of their addition."""
        folder.mkdir(parents=True)
        kinds: dict[Any, Any] = {}
        for _, name, _, _, fields in self.events:
            kinds.setdefault(name, (len(kinds), fields))
        metadata = METADATA
        for name, (number, fields) in kinds.items():
            members = " ".join(
                f"{'string' if isinstance(value, str) else 'u64'} {field};" for field, value in fields.items()
            )
            metadata += f'event {{ name = "{name}"; id = {number}; stream_id = 0; '
            metadata += f"fields := struct {{ {members} }}; }};\n"
        (folder / "metadata").write_text(metadata)
        body = b"".join(self.encoded(kinds, *event) for event in self.events)
        header = struct.calcsize("<IIQQQQQI")
        bits = 8 * (header + len(body))
        times = [event[0] for event in self.events]
        packets = [self.packet(min(times), max(times), bits, 0) + body]
        if self.discarded > 0:
            packets.append(self.packet(max(times), max(times) + 1, 8 * header, self.discarded))
        (folder / "stream_0").write_bytes(b"".join(packets))
        return folder

    @staticmethod
    def packet(begin: Any, end: Any, bits: int, discarded: int) -> Any:
        return struct.pack("<IIQQQQQI", MAGIC, 0, begin, end, bits, bits, discarded, 0)

    @staticmethod
    def encoded(kinds: Any, at: Any, name: str, process: Any, thread: Any, fields: Any) -> Any:
        text = struct.pack("<IQII", kinds[name][0], at, process, thread) + b"program\0"
        for value in fields.values():
            text += value.encode() + b"\0" if isinstance(value, str) else struct.pack("<Q", value)
        return text


def sensor_and_filter(periods: int = 200, **options: Any) -> tuple[Any, Any]:
    """A trace of a 10 ms timer with 2 ms of work, and of a subscription that works 3 ms on each
    message. Returns the trace and the means to extend it: the publisher, both callbacks, the
    subscription's handle and the next release.
    """
    trace = CtfTrace(**options)
    sensor, reader = trace.node(MS, "sensor"), trace.node(MS, "filter")
    publisher = trace.publisher(MS, sensor, "/points")
    timer = trace.timer(2 * MS, sensor, 10 * MS)
    rmw, subscription = trace.subscription(2 * MS, reader, "/points")
    handles = {"publisher": publisher, "timer": timer, "subscription": subscription, "rmw": rmw}
    handles |= {"at": (12 + 10 * periods) * MS, "nodes": (sensor, reader)}
    run_on(trace, handles, 12 * MS, periods)
    return trace, handles


def run_on(trace: Any, handles: Any, at: Any, periods: Any) -> None:
    """Extends the system of `sensor_and_filter` by this many periods from `at` on."""
    for _ in range(periods):
        stamp = trace.job(at + 20_000, at + 2 * MS, handles["timer"], publishes=handles["publisher"])
        trace.job(at + 2 * MS + 50_000, at + 5 * MS, handles["subscription"], takes=(handles["rmw"], stamp))
        at += 10 * MS
