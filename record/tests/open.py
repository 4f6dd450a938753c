#!/usr/bin/env python3
"""Opens records of shoal with the programs of others. Arguments: RECORD, ROS2_EXPORT and CSV_EXPORT of one run.

Needs mcap, mcap-protobuf-support, foxglove-schemas-protobuf and rosbags from PyPI; `record/tests/run` installs them."""

import csv
import re
import sys
from collections import Counter
from pathlib import Path

from google.protobuf import descriptor_pb2
from mcap.reader import make_reader
from mcap_protobuf.decoder import DecoderFactory

record, ros2, table = sys.argv[1:4]


def documented():
    """The decoder that docs/records.md shows."""
    page = Path(__file__).resolve().parents[2] / "docs" / "records.md"
    code = re.search(r"```python\n(.*?)```", page.read_text(), re.S).group(1)
    names = {}
    exec(compile(code, str(page), "exec"), names)
    return names["frames"]


def check_channels():
    counts, topics = Counter(), {}
    with open(record, "rb") as file:
        reader = make_reader(file, validate_crcs=True, decoder_factories=[DecoderFactory()])
        summary = reader.get_summary()
        for schema, channel, message, decoded in reader.iter_decoded_messages():
            counts[channel.topic] += 1
            topics[channel.topic] = (schema, decoded)
            assert decoded is not None
        attachments = {attachment.name for attachment in reader.iter_attachments()}
        metadata = {entry.name: entry.metadata for entry in reader.iter_metadata()}
    robots = [topic for topic in counts if topic.startswith("/robots/")]
    needed = {"shoal.frame", "shoal.event", "/tf", "/scene", "/goals", "/events", "/metrics"}
    assert needed <= set(counts), counts
    assert len(robots) == 17, robots
    assert counts["shoal.frame"] == int(metadata["shoal.end"]["ticks"]) + 1
    assert counts["shoal.event"] == counts["/events"]
    assert {"scenario.json", "scenario.bin", "outcome.json", "outcome.bin"} <= attachments, attachments
    assert metadata["shoal"]["name"] == "demo-15" and metadata["shoal"]["build"] != "unknown", metadata
    processes = {entry.process: entry for entry in topics["/metrics"][1].processes}
    assert len(processes) == 19 and processes["fleet"].periods > 0, list(processes)
    assert sum(counts.values()) == summary.statistics.message_count
    print(f"mcap: {sum(counts.values())} messages on {len(counts)} channels decode")
    return topics


def check_descriptors(topics):
    """Ours are those of Foxglove: same numbers, types and labels."""
    import foxglove_schemas_protobuf.Log_pb2 as log
    import foxglove_schemas_protobuf.FrameTransforms_pb2 as transforms
    import foxglove_schemas_protobuf.PoseInFrame_pb2 as pose
    import foxglove_schemas_protobuf.SceneUpdate_pb2 as scene

    theirs = {}

    def walk(message):
        if message.full_name not in theirs:
            theirs[message.full_name] = message
            for field in message.fields:
                if field.message_type is not None:
                    walk(field.message_type)

    for module, name in [(log, "Log"), (transforms, "FrameTransforms"), (pose, "PoseInFrame"), (scene, "SceneUpdate")]:
        walk(module.DESCRIPTOR.message_types_by_name[name])
    files = descriptor_pb2.FileDescriptorSet.FromString(topics["/scene"][0].data)
    checked = 0
    for file in files.file:
        for message in file.message_type:
            other = theirs[f"{file.package}.{message.name}"]
            own = [(f.name, f.number, f.type, f.label == f.LABEL_REPEATED) for f in message.field]
            repeated = lambda f: f.is_repeated if hasattr(f, "is_repeated") else f.label == f.LABEL_REPEATED
            expected = [(f.name, f.number, f.type, repeated(f)) for f in other.fields]
            assert own == expected, (message.name, own, expected)
            for enum in message.enum_type:
                values = [(v.name, v.number) for v in other.enum_types_by_name[enum.name].values]
                assert [(v.name, v.number) for v in enum.value] == values, (message.name, enum.name)
            checked += 1
    print(f"foxglove-schemas-protobuf: {checked} messages are the same")


def check_frames():
    """The documented decoder, the table and the transforms say the same."""
    frames = dict(documented()(record))
    lines = 0
    with open(table, newline="") as file:
        for row in csv.DictReader(file):
            bodies = frames[int(row["tick"])]
            if row["kind"] == "obstacle":
                _, values = bodies[int(row["name"]), True]
            else:
                slots = [key for key, (_, values) in bodies.items() if not key[1] and values[0] == float(row["x_m"])]
                assert slots, row
                _, values = bodies[slots[0]]
            assert values[:3] == [float(row[key]) for key in ("x_m", "y_m", "yaw_rad")], row
            lines += 1
    assert lines == sum(len(bodies) for bodies in frames.values())
    places = {(values[0], values[1]) for bodies in frames.values() for _, values in bodies.values()}
    with open(record, "rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _, _, _, message in reader.iter_decoded_messages(topics=["/tf"]):
            for transform in message.transforms:
                assert (transform.translation.x, transform.translation.y) in places
    print(f"frames: {lines} bodies in {len(frames)} frames, as the table has them")


def check_ros2():
    from rosbags.highlevel import AnyReader
    from rosbags.typesys import Stores, get_typestore

    counts = Counter()
    with AnyReader([Path(ros2)], default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
        for connection, _, raw in reader.messages():
            message = reader.deserialize(raw, connection.msgtype)
            counts[connection.msgtype] += 1
            if connection.msgtype == "visualization_msgs/msg/MarkerArray":
                assert len(message.markers) > 17
    expected = {"tf2_msgs/msg/TFMessage", "geometry_msgs/msg/PoseStamped", "visualization_msgs/msg/MarkerArray", "rcl_interfaces/msg/Log"}
    assert set(counts) == expected, counts
    print(f"rosbags: {sum(counts.values())} messages of {len(counts)} types")


topics = check_channels()
check_descriptors(topics)
check_frames()
check_ros2()
