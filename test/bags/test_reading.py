"""Bags as recorders make them are read to the bit; what cannot be used is refused with one sentence."""

import numpy as np
import pytest
from numpy.testing import assert_array_equal

pytest.importorskip("rosbags")

from rigid_body_sim.bags import codec
from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError
from rigid_body_sim.messages.cdr import LAYOUTS

from . import making

MESSAGES = making.some_messages()


def check(recording):
    """That everything in ``some_messages`` is there."""
    random = np.random.default_rng(6)
    numbers = np.array([random.normal(size=7) for _ in range(20)])
    stamps = making.EPOCH_NS + 10_000_000 * np.arange(20)
    assert set(recording.wrenches) == {"/wrench", "/raw"}
    wrench, raw = recording.wrenches["/wrench"], recording.wrenches["/raw"]
    assert_array_equal(wrench.values, numbers[:, :6])
    assert_array_equal(raw.values, numbers[:, :6])
    assert wrench.frame_ids.tolist() == [("base_link", "world", "größe")[k % 3] for k in range(20)]
    assert set(raw.frame_ids) == {""} and not raw.stamp_ns.any()
    assert_array_equal(wrench.stamp_ns, stamps)
    assert_array_equal(wrench.receive_ns, stamps + 1)
    assert_array_equal(raw.receive_ns, stamps + 2)
    assert_array_equal(recording.poses["/pose"].values, numbers)
    assert_array_equal(recording.twists["/twist"].values, numbers[:, :6])
    assert recording.journal == [f'{{"k": {k}}}' for k in range(20)]
    assert recording.types["/chatter"] == "std_msgs/msg/String"


@pytest.mark.parametrize("packed", (None, "file", "message"))
@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_every_kind_of_bag_is_read_to_the_bit(tmp_path, storage, packed):
    recording = read(making.make(tmp_path / "bag", MESSAGES, storage, packed))
    check(recording)
    assert recording.notes == []


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
@pytest.mark.parametrize("packed", (None, "file"))
def test_lone_file_is_read(tmp_path, storage, packed):
    making.make(tmp_path / "bag", MESSAGES, storage, packed)
    (file,) = (file for file in (tmp_path / "bag").iterdir() if file.name != "metadata.yaml")
    check(read(file))


def test_folder_without_description_is_read_file_by_file(tmp_path):
    folder = making.make(tmp_path / "bag", MESSAGES)
    (folder / "metadata.yaml").unlink()
    recording = read(folder)
    check(recording)
    assert "metadata.yaml" in recording.notes[0]


def test_files_of_one_bag_may_overlap(tmp_path):
    """A split bag without metadata, the later half in the file whose name comes first."""
    making.make(tmp_path / "bag", MESSAGES[60:])
    making.make(tmp_path / "rest", MESSAGES[:60])
    (tmp_path / "rest" / "rest.mcap").rename(tmp_path / "bag" / "later.mcap")
    (tmp_path / "bag" / "metadata.yaml").unlink()
    check(read(tmp_path / "bag"))


def cut(tmp_path, part):
    """A bag whose file ends after a part of it, as when its writer is killed: no index, no metadata."""
    folder = making.make(tmp_path / "bag", MESSAGES)
    (folder / "metadata.yaml").unlink()
    file = folder / "bag.mcap"
    whole = file.read_bytes()
    file.write_bytes(whole[: int(part * len(whole))])
    return folder


def test_file_without_an_end_is_read_when_asked_to_recover(tmp_path):
    folder = cut(tmp_path, 0.95)  # within the index, behind all messages
    with pytest.raises(BagError, match=r"bag\.mcap: has no end, its writer was killed .* --recover"):
        read(folder)
    recording = read(folder, recover=True)
    check(recording)
    assert any("has no end" in note for note in recording.notes)


def test_what_is_whole_is_a_part_that_begins_at_the_start(tmp_path):
    """Chunks are written one by one: messages of 20 files' worth, of which some chunks are lost."""
    many = [(topic, receive_ns + r * 10**9, message) for r in range(400) for topic, receive_ns, message in MESSAGES]
    folder = making.make(tmp_path / "bag", many)
    (folder / "metadata.yaml").unlink()
    whole = (folder / "bag.mcap").read_bytes()
    everything = read(folder).wrenches["/wrench"]
    (folder / "bag.mcap").write_bytes(whole[: len(whole) // 2])
    part = read(folder, recover=True).wrenches["/wrench"]
    assert 0 < len(part) < len(everything)
    assert_array_equal(part.values, everything.values[: len(part)])


def test_several_connections_for_one_topic_are_one(tmp_path):
    """As some recorders make them, and Writer does for other QoS."""
    bag = making.Writer(tmp_path / "bag", version=9, storage_plugin=making.StoragePlugin.MCAP)
    bag.open()
    kind = "geometry_msgs/msg/Wrench"
    for k, format_ in enumerate(("cdr", "cdr2")):
        connection = bag.add_connection("/wrench", kind, typestore=making.STORE, serialization_format=format_)
        data = bytes(making.STORE.serialize_cdr(making.wrench([k] * 6), kind))
        bag.write(connection, 10 - k, data)
    bag.close()
    assert read(tmp_path / "bag" / "bag.mcap").wrenches["/wrench"].values[:, 0].tolist() == [1.0, 0.0]


def test_big_endian_messages_are_read(tmp_path):
    kind = "geometry_msgs/msg/WrenchStamped"
    message = making.wrench_stamped(making.EPOCH_NS, "base_link", range(6))
    data = bytes(making.STORE.serialize_cdr(message, kind, little_endian=False))
    little = bytes(making.STORE.serialize_cdr(message, kind))
    wrench = read(making.make(tmp_path / "bag", [("/w", 1, (kind, data)), ("/w", 2, (kind, little))])).wrenches["/w"]
    assert_array_equal(wrench.values, [range(6), range(6)])
    assert wrench.stamp_ns.tolist() == [making.EPOCH_NS] * 2 and wrench.frame_ids.tolist() == ["base_link"] * 2


@pytest.mark.parametrize("kind", [kind for kind, layout in LAYOUTS.items() if layout.names == 1])
@pytest.mark.parametrize("frame_id", ("", "w", "world", "base_link", "größe", "f" * 300))
def test_encoded_is_what_rosbags_makes(kind, frame_id):
    layout = LAYOUTS[kind]
    values = np.random.default_rng(1).normal(size=(3, layout.doubles))
    stamps = np.array([0, making.EPOCH_NS, 2**31 * 10**9 - 1])
    back = [making.STORE.deserialize_cdr(data, kind) for data in codec.encode(stamps, frame_id, values)]
    again = [bytes(making.STORE.serialize_cdr(message, kind)) for message in back]
    assert again == codec.encode(stamps, frame_id, values)
    decoded = codec.decode(again, layout)
    assert_array_equal(decoded.values, values)
    assert_array_equal(decoded.stamp_ns, stamps)
    assert decoded.frame_ids.tolist() == [frame_id] * 3 and not len(decoded.unusual)


# Bad bags -------------------------------------------------------------------------------------------------------------


def refusal(path):
    with pytest.raises(BagError) as caught:
        read(path)
    text = str(caught.value)
    assert str(path) in text and "\n" not in text
    return text


def test_nothing_there(tmp_path):
    assert "does not exist" in refusal(tmp_path / "none")


def test_folder_that_is_no_bag(tmp_path):
    (tmp_path / "notes.txt").write_text("no bag")
    assert "no bag" in refusal(tmp_path)
    assert "no bag" in refusal(tmp_path / "notes.txt")


def test_bag_of_ros_1(tmp_path):
    (tmp_path / "old.bag").write_bytes(b"#ROSBAG V2.0\n")
    assert "ROS 1; convert it (rosbags-convert" in refusal(tmp_path / "old.bag")


@pytest.mark.parametrize("suffix", (".mcap", ".db3", ".mcap.zstd"))
@pytest.mark.parametrize("content", (b"", b"nothing of the kind" * 10), ids=("empty", "text"))
def test_file_of_that_name_with_other_content(tmp_path, suffix, content):
    file = tmp_path / f"bag{suffix}"
    file.write_bytes(content)
    assert "cannot be read" in refusal(file)


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_empty_bag(tmp_path, storage):
    assert "holds no message" in refusal(making.make(tmp_path / "bag", [], storage))


@pytest.mark.parametrize("part", (0.1, 0.5, 0.9))
def test_cut_sqlite_file(tmp_path, part):
    folder = making.make(tmp_path / "bag", MESSAGES * 50, "sqlite3")
    whole = (folder / "bag.db3").read_bytes()
    (folder / "bag.db3").write_bytes(whole[: int(part * len(whole))])
    assert "cannot be read" in refusal(folder)


@pytest.mark.parametrize("place", (0.2, 0.4))
def test_damaged_mcap_file(tmp_path, place):
    """Bytes within a chunk are zeroed; the file has its end."""
    folder = making.make(tmp_path / "bag", MESSAGES)
    data = bytearray((folder / "bag.mcap").read_bytes())
    at = int(place * len(data))
    data[at : at + 3000] = bytes(3000)
    (folder / "bag.mcap").write_bytes(data)
    assert "cannot be read" in refusal(folder)


@pytest.mark.parametrize("recover", (False, True))
@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_whatever_happens_to_a_file_it_is_read_or_refused(tmp_path, storage, recover):
    random = np.random.default_rng(9)
    folder = making.make(tmp_path / "bag", MESSAGES, storage)
    (file,) = (file for file in folder.iterdir() if file.name != "metadata.yaml")
    whole = file.read_bytes()
    refused = 0
    for _ in range(60):
        data = bytearray(whole)
        at, length = int(random.integers(len(data))), int(random.integers(1, 60))
        data[at : at + length] = random.bytes(int(random.choice((0, length))))
        file.write_bytes(data)
        try:
            read(file, recover=recover)
        except BagError as reason:
            assert str(file) in str(reason) and "\n" not in str(reason)
            refused += 1
    assert refused > 10  # of 60; SQLite has no checksums


def test_packed_file_without_an_end_is_named_as_it_was_given(tmp_path):
    """Not as the copy that it was unpacked into."""
    zstd = pytest.importorskip("backports.zstd")
    folder = making.make(tmp_path / "bag", MESSAGES)
    packed = tmp_path / "cut.mcap.zstd"
    packed.write_bytes(zstd.compress((folder / "bag.mcap").read_bytes()[:-200]))
    assert refusal(packed).startswith(f"{packed}: has no end")
    assert "cut.mcap.zstd has no end: what is whole in it is taken." in read(packed, recover=True).notes


def test_unknown_packing_of_files(tmp_path):
    folder = making.make(tmp_path / "bag", MESSAGES, packed="file")
    described = (folder / "metadata.yaml").read_text()
    (folder / "metadata.yaml").write_text(described.replace("compression_format: zstd", "compression_format: xz"))
    assert "'xz' is not supported" in refusal(folder)


def test_unknown_packing_of_chunks(tmp_path):
    from rosbags.rosbag2.enums import CompressionMode

    bag = making.Writer(tmp_path / "bag", version=9, storage_plugin=making.StoragePlugin.MCAP)
    bag.set_compression(CompressionMode.STORAGE, making.CompressionFormat.ZSTD)
    bag.open()
    connection = bag.add_connection("/wrench", "geometry_msgs/msg/Wrench", typestore=making.STORE)
    bag.write(connection, 1, bytes(making.STORE.serialize_cdr(making.wrench(range(6)), "geometry_msgs/msg/Wrench")))
    bag.close()
    file = tmp_path / "bag" / "bag.mcap"
    data = file.read_bytes()
    assert b"zstd" in data
    assert read(file).wrenches["/wrench"].values.tolist() == [[0, 1, 2, 3, 4, 5]]
    file.write_bytes(data.replace(b"zstd", b"best"))
    assert "'best'" in refusal(file)


def test_description_that_is_none(tmp_path):
    folder = making.make(tmp_path / "bag", MESSAGES)
    (folder / "metadata.yaml").write_text("hello: [")
    assert "cannot be read" in refusal(folder)


def test_messages_of_another_distribution(tmp_path):
    kind = "geometry_msgs/msg/Wrench"
    other = (
        "geometry_msgs/Vector3 force\n" + "=" * 80 + "\nMSG: geometry_msgs/Vector3\nfloat32 x\nfloat32 y\nfloat32 z\n"
    )
    folder = making.make(tmp_path / "bag", [("/w", 1, (kind, bytes(16)))], definitions={kind: other})
    assert "/w holds geometry_msgs/msg/Wrench in which geometry_msgs/msg/Wrench has other fields" in refusal(folder)


def test_messages_that_are_not_what_their_type_says(tmp_path):
    kind = "geometry_msgs/msg/WrenchStamped"
    folder = making.make(tmp_path / "bag", [("/w", 1, (kind, b"\0\1\0\0" + bytes(20)))])
    assert "message 1 of topic /w, of 24 bytes, is not a serialised" in refusal(folder)


def test_topics_that_leave_open_what_is_meant(tmp_path):
    messages = [("/w", 1, making.wrench(range(6))), ("/w", 2, making.wrench_stamped(2, "", range(6)))]
    assert "topic /w has messages of two types" in refusal(making.make(tmp_path / "bag", messages))
    journals = [(f"/{robot}/node/journal", k, making.text("{}")) for k, robot in enumerate("ab")]
    assert "has journals of several nodes" in refusal(making.make(tmp_path / "two", journals))


def test_without_rosbags(tmp_path, monkeypatch):
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag2", None)
    with pytest.raises(BagError, match=r"pip install '\.\[bag,fast\]'"):
        read(tmp_path)
