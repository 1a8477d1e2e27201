"""What is in a bag that a node has recorded."""

import struct

import pytest

from rigid_body_sim import Simulation
from rigid_body_sim.bags import journal
from rigid_body_sim.resim.journaled import replay


class Bag:
    """Messages of a bag as (log time, bytes) by topic, the node's namespace left out, and its journal."""

    def __init__(self, messages, namespace=""):
        self.messages = {}
        for topic, time_ns, data in sorted(messages, key=lambda message: message[1]):
            self.messages.setdefault(topic.removeprefix(namespace), []).append((time_ns, bytes(data)))
        self.entries = journal.read(text(data) for _, data in self.messages["/rigid_body_node/journal"])

    def stamps(self, topic):
        return [stamp_ns(data) for _, data in self.messages[topic]]

    def calls(self):
        return [entry.call for entry in self.entries]

    def assert_repeats(self):
        """The journal alone gives every pose and twist again, byte for byte but for the head; returns their number."""
        motions = [(time_ns, data, pose) for time_ns, data in self.messages["/pose"]]
        motions += [(time_ns, data, twist) for time_ns, data in self.messages["/twist"]]
        motions.sort(key=lambda motion: motion[0])
        simulation = Simulation.from_scene(journal.beginning(self.entries).scene)
        times = [(time_ns, stamp_ns(data)) for time_ns, data, _ in motions]
        again = replay(self.entries, simulation, times)
        for (_, data, numbers), repeated in zip(motions, again, strict=True):
            values = numbers(repeated.motion)
            assert data[-8 * len(values) :] == struct.pack(f"<{len(values)}d", *values)
        return len(motions)


def read(folder, namespace=""):
    """A bag that was closed."""
    from rosbags.highlevel import AnyReader

    with AnyReader([folder]) as reader:
        return Bag([(connection.topic, time_ns, data) for connection, time_ns, data in reader.messages()], namespace)


def read_unfinished(folder, namespace=""):
    """A bag whose writer was killed: whole records, then nothing or a part of one."""
    from mcap.exceptions import EndOfFile
    from mcap.records import Channel, Message
    from mcap.stream_reader import StreamReader

    topics, messages = {}, []
    with (folder / f"{folder.name}_0.mcap").open("rb") as file, pytest.raises(EndOfFile):
        for record in StreamReader(file).records:
            if isinstance(record, Channel):
                topics[record.id] = record.topic
            elif isinstance(record, Message):
                messages.append((topics[record.channel_id], record.log_time, record.data))
    return Bag(messages, namespace)


def stamp_ns(data):
    """Of a message that begins with a header."""
    seconds, nanoseconds = struct.unpack_from("<iI", data, 4)
    return seconds * 1_000_000_000 + nanoseconds


def text(data):
    return data[8:-1].decode()


def pose(motion):
    x, y, z, qw, qx, qy, qz = motion[0:7]
    return x, y, z, qx, qy, qz, qw


def twist(motion):
    return motion[13:19]
