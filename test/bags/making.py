"""Bags made by rosbags for the tests, as other recorders make them."""

import contextlib
import shutil
import sqlite3

import numpy as np
from rosbags.rosbag2 import CompressionFormat, CompressionMode, Reader, StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
TABLES = """
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
  serialization_format TEXT NOT NULL{});
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL,
  data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
"""
QOS, HASH = ", offered_qos_profiles TEXT NOT NULL", ", type_description_hash TEXT NOT NULL"
COVARIANCE = np.arange(36.0)
EPOCH_NS = 1_700_000_000_000_000_000


def header(stamp_ns, frame_id):
    return T["std_msgs/msg/Header"](T["builtin_interfaces/msg/Time"](*divmod(int(stamp_ns), 10**9)), frame_id)


def vector(numbers):
    return T["geometry_msgs/msg/Vector3"](*map(float, numbers))


def wrench(numbers):
    return T["geometry_msgs/msg/Wrench"](vector(numbers[:3]), vector(numbers[3:]))


def wrench_stamped(stamp_ns, frame_id, numbers):
    return T["geometry_msgs/msg/WrenchStamped"](header(stamp_ns, frame_id), wrench(numbers))


def pose_stamped(stamp_ns, frame_id, numbers):
    """``numbers``: position and quaternion w, x, y, z."""
    w, x, y, z = map(float, numbers[3:7])
    position = T["geometry_msgs/msg/Point"](*map(float, numbers[:3]))
    pose = T["geometry_msgs/msg/Pose"](position, T["geometry_msgs/msg/Quaternion"](x, y, z, w))
    return T["geometry_msgs/msg/PoseStamped"](header(stamp_ns, frame_id), pose)


def twist_stamped(stamp_ns, frame_id, numbers):
    twist = T["geometry_msgs/msg/Twist"](vector(numbers[:3]), vector(numbers[3:]))
    return T["geometry_msgs/msg/TwistStamped"](header(stamp_ns, frame_id), twist)


def odometry(stamp_ns, frame_id, child_id, pose, twist):
    """``pose``: as of ``pose_stamped``; ``twist`` in the axes of the child."""
    whole = pose_with_covariance(stamp_ns, frame_id, pose)
    twist = twist_with_covariance(stamp_ns, child_id, twist).twist
    return T["nav_msgs/msg/Odometry"](whole.header, child_id, whole.pose, twist)


def pose_with_covariance(stamp_ns, frame_id, numbers):
    plain = pose_stamped(stamp_ns, frame_id, numbers)
    whole = T["geometry_msgs/msg/PoseWithCovariance"](plain.pose, COVARIANCE)
    return T["geometry_msgs/msg/PoseWithCovarianceStamped"](plain.header, whole)


def twist_with_covariance(stamp_ns, frame_id, numbers):
    plain = twist_stamped(stamp_ns, frame_id, numbers)
    whole = T["geometry_msgs/msg/TwistWithCovariance"](plain.twist, COVARIANCE)
    return T["geometry_msgs/msg/TwistWithCovarianceStamped"](plain.header, whole)


def transform_stamped(stamp_ns, frame_id, child_id, numbers):
    w, x, y, z = map(float, numbers[3:7])
    transform = T["geometry_msgs/msg/Transform"](vector(numbers[:3]), T["geometry_msgs/msg/Quaternion"](x, y, z, w))
    return T["geometry_msgs/msg/TransformStamped"](header(stamp_ns, frame_id), child_id, transform)


def numbers(given):
    layout = T["std_msgs/msg/MultiArrayLayout"]([], 0)
    return T["std_msgs/msg/Float64MultiArray"](layout, np.array(given, float))


def text(data):
    return T["std_msgs/msg/String"](data)


def without_journal(folder):
    """What is in a bag, as ``make`` takes it."""
    with Reader(folder) as reader:
        return [
            (connection.topic, time_ns, (connection.msgtype, data))
            for connection, time_ns, data in reader.messages()
            if not connection.topic.endswith("/journal")
        ]


def make(folder, messages, storage="mcap", packed=None, definitions=None):
    """A bag at ``folder`` with ``messages``: (topic, time of receipt [ns], message or (its type, bytes)).

    ``packed`` is None, "file" or "message"; ``definitions`` gives other texts for types than ROS 2 Jazzy has.
    """
    bag = Writer(folder, version=9, storage_plugin=StoragePlugin[storage.upper()])
    if packed:
        bag.set_compression(CompressionMode[packed.upper()], CompressionFormat.ZSTD)
    bag.open()
    connections = {}
    for topic, receive_ns, message in messages:
        kind, data = message if isinstance(message, tuple) else (message.__msgtype__, None)
        if (topic, kind) not in connections:
            known = {"typestore": STORE}
            if kind in (definitions or {}):
                known = {"msgdef": definitions[kind], "rihs01": "RIHS01_" + 64 * "0"}
            connections[topic, kind] = bag.add_connection(topic, kind, **known)
        data = STORE.serialize_cdr(message, kind) if data is None else data
        bag.write(connections[topic, kind], int(receive_ns), bytes(data))
    bag.close()
    return folder


def some_messages():
    """A few of each kind, out of a random motion; the same every time."""
    random = np.random.default_rng(6)
    messages = []
    for k in range(20):
        now_ns = EPOCH_NS + k * 10_000_000
        numbers = random.normal(size=7)
        messages += [
            ("/wrench", now_ns + 1, wrench_stamped(now_ns, ("base_link", "world", "größe")[k % 3], numbers)),
            ("/raw", now_ns + 2, wrench(numbers)),
            ("/pose", now_ns + 3, pose_stamped(now_ns, "world", numbers)),
            ("/twist", now_ns + 4, twist_stamped(now_ns, "base_link", numbers)),
            ("/rigid_body_node/journal", now_ns + 5, text(f'{{"k": {k}}}')),
            ("/chatter", now_ns + 6, text("not read")),
        ]
    return messages


def add(database, messages):
    """Put messages into a bag's tables, in one transaction."""
    topics = {name: number for number, name in database.execute("SELECT id, name FROM topics")}
    width = len(database.execute("SELECT * FROM topics LIMIT 0").description)
    with database:
        for name, receive_ns, message in messages:
            kind = message.__msgtype__
            if name not in topics:
                topics[name] = len(topics) + 1
                row = (topics[name], name, kind, "cdr", "", "")[:width]
                database.execute(f"INSERT INTO topics VALUES ({','.join('?' * width)})", row)
            data = bytes(STORE.serialize_cdr(message, kind))
            row = topics[name], receive_ns, data
            database.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", row)


def killed(folder, messages):
    """A bag as a recorder leaves it that is killed: half of it is in the file, half in the log beside it."""
    folder.mkdir()
    with contextlib.closing(sqlite3.connect(folder / "live.db3")) as live:
        live.execute("PRAGMA journal_mode=wal")
        live.execute("PRAGMA wal_autocheckpoint=0")
        live.executescript(TABLES.format(QOS))
        add(live, messages[: len(messages) // 2])
        live.execute("PRAGMA wal_checkpoint(TRUNCATE)")
        for at in range(len(messages) // 2, len(messages), 10):
            add(live, messages[at : at + 10])
        for end in ("", "-wal", "-shm"):
            shutil.copyfile(folder / f"live.db3{end}", folder / f"x_0.db3{end}")
    (folder / "live.db3").unlink()
    return folder
