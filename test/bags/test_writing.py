"""A bag that is written reads back with the libraries that others use, and it is said why one cannot be written."""

import re
import resource
import struct
import sys

import pytest
import yaml

from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError, typestore
from rigid_body_sim.bags.writing import CHUNK_BYTES, BagWriter, Topic
from rigid_body_sim.messages.cdr import serialised_text

pytest.importorskip("rosbags")

TOPICS = [
    Topic("/n/pose", "geometry_msgs/msg/PoseStamped", depth=1, durability="transient_local"),
    Topic("/n/wrench", "geometry_msgs/msg/WrenchStamped", reliability="best_effort"),
    Topic("/n/rigid_body_node/journal", "std_msgs/msg/String"),
]
START_NS = 1_700_000_000_123_456_789


def pose(number):
    """A serialised PoseStamped in the frame "world", whose numbers tell ``number``."""
    head = struct.pack("<iII12s", number, 2 * number, 6, b"world\0")
    return b"\x00\x01\x00\x00" + head + struct.pack("<7d", *(number + i / 7 for i in range(7)))


def messages(count):
    """So many poses and, after every tenth, a text."""
    for i in range(count):
        yield 0, START_NS + 10 * i, pose(i)
        if i % 10 == 0:
            yield 2, START_NS + 10 * i + 1, serialised_text(f'{{"entry": "ä{i}"}}')


def write(folder, count=100):
    with BagWriter(folder, TOPICS) as bag:
        bag.write(messages(count))
    return bag


@pytest.mark.parametrize("count", [1, 100, 30000], ids="{} poses".format)
def test_rosbags_reads_every_byte(tmp_path, count):
    from rosbags.highlevel import AnyReader

    bag = write(tmp_path / "bag", count)
    with AnyReader([tmp_path / "bag"]) as reader:
        places = {topic.name: place for place, topic in enumerate(TOPICS)}
        back = [(places[connection.topic], time_ns, data) for connection, time_ns, data in reader.messages()]
        definitions = {connection.topic: connection.digest for connection in reader.connections}
    assert back == list(messages(count))
    assert bag.written == len(back)
    assert definitions["/n/pose"] == "RIHS01_10f3786d7d40fd2b54367835614bff85d4ad3b5dab62bf8bca0cc232d73b4cd8"


def test_mcap_reads_every_byte_of_many_chunks(tmp_path):
    from mcap.reader import make_reader

    count = 3 * CHUNK_BYTES // len(pose(0))
    write(tmp_path / "bag", count)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        reader = make_reader(file, validate_crcs=True)
        summary = reader.get_summary()
        back = [(message.log_time, message.data) for _, _, message in reader.iter_messages()]
    assert back == [message[1:] for message in messages(count)]
    assert len(summary.chunk_indexes) >= 3
    assert summary.statistics.message_count == len(back)
    assert (summary.statistics.message_start_time, summary.statistics.message_end_time) == (back[0][0], back[-1][0])


def test_mcap_ros2_support_decodes_the_fields(tmp_path):
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    write(tmp_path / "bag", 20)
    with (tmp_path / "bag" / "bag_0.mcap").open("rb") as file:
        decoded = list(make_reader(file, decoder_factories=[DecoderFactory()]).iter_decoded_messages())
    poses = [message.decoded_message for message in decoded if message.channel.topic == "/n/pose"]
    texts = [message.decoded_message.data for message in decoded if message.channel.topic.endswith("journal")]
    assert [message.header.stamp.sec for message in poses] == list(range(20))
    assert {message.header.frame_id for message in poses} == {"world"}
    assert [message.pose.orientation.w for message in poses] == [i + 6 / 7 for i in range(20)]
    assert texts == ['{"entry": "ä0"}', '{"entry": "ä10"}']


def test_metadata_is_that_of_jazzy(tmp_path):
    write(tmp_path / "bag", 30)
    assert sorted(path.name for path in (tmp_path / "bag").iterdir()) == ["bag_0.mcap", "metadata.yaml"]
    information = yaml.safe_load((tmp_path / "bag" / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert (information["version"], information["storage_identifier"]) == (9, "mcap")
    assert (information["message_count"], information["starting_time"]) == (
        33,
        {"nanoseconds_since_epoch": START_NS},
    )
    found = {entry["topic_metadata"]["name"]: entry for entry in information["topics_with_message_count"]}
    assert {name: entry["message_count"] for name, entry in found.items()} == {
        "/n/pose": 30,
        "/n/wrench": 0,
        "/n/rigid_body_node/journal": 3,
    }
    (qos,) = found["/n/pose"]["topic_metadata"]["offered_qos_profiles"]
    assert (qos["durability"], qos["reliability"], qos["depth"]) == ("transient_local", "reliable", 1)


@pytest.mark.parametrize("count", (0, 30))
def test_bag_is_described_as_by_another_writer(tmp_path, count):
    """Of the same version; and with the hash of each type beside the QoS, as rosbag2 has it."""
    write(tmp_path / "bag", count)
    write_by_rosbags(tmp_path / "other" / "bag", count)
    ours, other = (described(tmp_path / folder) for folder in ("bag", "other/bag"))
    assert ours["metadata.yaml"] == {**other["metadata.yaml"], "ros_distro": "jazzy"}
    assert ours["rosbag2"] == ours["metadata.yaml"]
    assert ours["schemas"] == other["schemas"] and ours["qos"] == other["qos"]
    topics = [topic["topic_metadata"] for topic in ours["metadata.yaml"]["topics_with_message_count"]]
    assert ours["hashes"] == {topic["name"]: topic["type_description_hash"] for topic in topics}
    assert (ours["profile"], len(ours["hashes"])) == ("ros2", 3)


def write_by_rosbags(folder, count):
    from rosbags.interfaces import Qos, QosDurability, QosHistory, QosLiveliness, QosReliability, QosTime
    from rosbags.rosbag2 import StoragePlugin, Writer

    for_ever = QosTime(9223372036, 854775807)
    with Writer(folder, version=9, storage_plugin=StoragePlugin.MCAP) as bag:
        bag.storage.path = bag.storage.path.rename(folder / "bag_0.mcap")
        connections = []
        for topic in TOPICS:
            reliability, durability = QosReliability[topic.reliability.upper()], QosDurability[topic.durability.upper()]
            ends = for_ever, for_ever, QosLiveliness.AUTOMATIC, for_ever, False
            qos = Qos(QosHistory.KEEP_LAST, topic.depth, reliability, durability, *ends)
            add = bag.add_connection
            connections.append(add(topic.name, topic.type, typestore=typestore(), offered_qos_profiles=[qos]))
        for place, time_ns, data in messages(count):
            bag.write(connections[place], time_ns, data)


def described(folder):
    """What the bag says of itself."""
    from mcap.reader import make_reader

    with (folder / "bag_0.mcap").open("rb") as file:
        reader = make_reader(file)
        channels = reader.get_summary().channels.values()
        schemas = reader.get_summary().schemas
        (metadata,) = reader.iter_metadata()
        return {
            "profile": reader.get_header().profile,
            "metadata.yaml": yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"],
            metadata.name: yaml.safe_load(metadata.metadata["serialized_metadata"]),
            "schemas": {channel.topic: schemas[channel.schema_id] for channel in channels},
            "qos": {channel.topic: yaml.safe_load(channel.metadata["offered_qos_profiles"]) for channel in channels},
            "hashes": {channel.topic: channel.metadata.get("topic_type_hash") for channel in channels},
        }


@pytest.mark.parametrize("name", ("bag", "run.1", "my_run_7"))
def test_file_has_the_name_by_which_rosbag2_finds_it(tmp_path, name):
    """`ros2 bag reindex` takes files that match this alone; without it, it cannot repair what a killed node leaves."""
    bag = BagWriter(tmp_path / name, TOPICS)
    (file,) = (tmp_path / name).iterdir()
    assert file.name == f"{name}_0.mcap" and re.fullmatch(r".+_(\d+)\.([a-zA-Z0-9])+", file.name)[1] == "0"
    bag.close()
    information = yaml.safe_load((tmp_path / name / "metadata.yaml").read_text())["rosbag2_bagfile_information"]
    assert information["relative_file_paths"] == [entry["path"] for entry in information["files"]] == [file.name]
    assert {path.name for path in (tmp_path / name).iterdir()} == {"metadata.yaml", file.name}


def test_what_is_flushed_can_be_read_before_the_end(tmp_path):
    """As after SIGKILL: no index, no metadata.yaml."""
    bag = BagWriter(tmp_path / "bag", TOPICS)
    bag.write(messages(200))
    bag.flush()
    bag.write(messages(50))
    assert stream(tmp_path / "bag" / "bag_0.mcap") == list(messages(200))
    assert bag.written == 220
    bag.abandon()


def test_damage_within_a_message_is_told(tmp_path):
    """One bit of one number, in any of the chunks, is not taken for another motion."""
    from mcap.reader import make_reader
    from mcap.stream_reader import CRCValidationError

    with BagWriter(tmp_path / "bag", TOPICS) as bag:
        bag.write(messages(100))
        bag.flush()
        bag.write(messages(100))
    file = tmp_path / "bag" / "bag_0.mcap"
    whole = file.read_bytes()
    number = struct.pack("<d", 57 + 6 / 7)
    places = [match.start() for match in re.finditer(re.escape(number), whole)]
    assert len(places) == 2 and len(read(file).poses["/n/pose"]) == 200
    for place in places:
        file.write_bytes(whole[:place] + bytes([whole[place] ^ 1]) + whole[place + 1 :])
        for path in (file, file.parent):
            with pytest.raises(BagError, match=r"cannot be read, it is damaged .*checksum"):
                read(path)
        with file.open("rb") as stream_, pytest.raises(CRCValidationError):
            list(make_reader(stream_, validate_crcs=True).iter_messages())


def test_full_disk_leaves_whole_chunks(tmp_path):
    """The limit on the size of files is to this process what a full disk is."""
    bag = BagWriter(tmp_path / "bag", TOPICS)
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (12 * CHUNK_BYTES, before[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            bag.write(messages(100_000))
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert bag.written > 10_000
    assert stream(tmp_path / "bag" / "bag_0.mcap") == list(messages(100_000))[: bag.written]
    bag.close()
    assert not (tmp_path / "bag" / "metadata.yaml").exists()


def stream(path):
    """The messages of a file without an end, which holds whole records."""
    from mcap.exceptions import EndOfFile
    from mcap.records import Message
    from mcap.stream_reader import StreamReader

    found = []
    with path.open("rb") as file, pytest.raises(EndOfFile):
        for record in StreamReader(file).records:
            if isinstance(record, Message):
                found.append((record.channel_id - 1, record.log_time, record.data))
    return found


def test_no_room_for_the_index_leaves_whole_chunks(tmp_path):
    bag = BagWriter(tmp_path / "bag", TOPICS)
    bag.write(messages(1000))
    bag.flush()
    file = tmp_path / "bag" / "bag_0.mcap"
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (file.stat().st_size + 100, before[1]))
    try:
        with pytest.raises(OSError, match="too large"):
            bag.close()
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert stream(file) == list(messages(1000))
    assert [path.name for path in (tmp_path / "bag").iterdir()] == ["bag_0.mcap"]


def test_removed_folder_is_an_error_at_the_end(tmp_path):
    bag = BagWriter(tmp_path / "bag", TOPICS)
    bag.write(messages(10))
    (tmp_path / "bag" / "bag_0.mcap").unlink()
    (tmp_path / "bag").rmdir()
    with pytest.raises(FileNotFoundError):
        bag.close()
    bag.close()


def test_after_an_exception_there_is_no_description(tmp_path):
    with pytest.raises(ZeroDivisionError), BagWriter(tmp_path / "bag", TOPICS) as bag:
        bag.write(messages(10))
        raise ZeroDivisionError
    assert [path.name for path in (tmp_path / "bag").iterdir()] == ["bag_0.mcap"]


# What is refused ------------------------------------------------------------------------------------------------------


def test_existing_folder(tmp_path):
    with pytest.raises(BagError, match=r"exists already; give a folder that does not exist yet$"):
        BagWriter(tmp_path, TOPICS)
    assert list(tmp_path.iterdir()) == []


def test_folder_below_a_file(tmp_path):
    (tmp_path / "file").touch()
    with pytest.raises(BagError, match=r"cannot be made \(Not a directory\); give a folder that can be$"):
        BagWriter(tmp_path / "file" / "bag", TOPICS)


def test_unknown_type(tmp_path):
    with pytest.raises(BagError, match="type my_msgs/msg/Nothing is not one of ROS 2 Jazzy"):
        BagWriter(tmp_path / "bag", [Topic("/a", "my_msgs/msg/Nothing")])
    assert list(tmp_path.iterdir()) == []


def test_without_rosbags(tmp_path, monkeypatch):
    from rigid_body_sim.bags import rosbags_support

    rosbags_support.typestore.cache_clear()
    monkeypatch.setitem(sys.modules, "rosbags.rosbag2", None)
    with pytest.raises(BagError, match=r"pip install '\.\[bag,fast\]'"):
        BagWriter(tmp_path / "bag", TOPICS)
    assert list(tmp_path.iterdir()) == []
