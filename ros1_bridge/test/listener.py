#!/usr/bin/python3
# SPDX-License-Identifier: Apache-2.0
"""listener.py TOPIC=PACKAGE/TYPE...: subscribes like any ROS 1 node and prints each message as one
line of JSON."""

import base64
import json
import sys
import threading
from typing import Any

import genpy
import roslib.message
import rospy


def plain(value: Any) -> Any:
    if isinstance(value, genpy.Message):
        return {name: plain(getattr(value, name)) for name in value.__slots__}
    if isinstance(value, (genpy.Time, genpy.Duration)):
        return value.to_nsec()
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return value


def main() -> None:
    rospy.init_node("listener", anonymous=True, disable_signals=True)
    lock = threading.Lock()

    def say(record: Any) -> None:
        with lock:
            sys.stdout.write(json.dumps(record) + "\n")
            sys.stdout.flush()

    for argument in sys.argv[1:]:
        topic, _, name = argument.partition("=")

        def callback(message: Any, topic: Any = topic) -> None:
            say({"topic": topic, "message": plain(message)})

        rospy.Subscriber(
            topic, roslib.message.get_message_class(name), callback, queue_size=None, tcp_nodelay=True
        )
    say({"topic": None, "message": "subscribed"})
    sys.stdin.read()  # blocks until the parent process closes it


if __name__ == "__main__":
    main()
