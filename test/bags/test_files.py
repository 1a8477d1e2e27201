"""Everything that a bag holds is read, wherever rosbag2 has left it, or it is said what is not."""

import contextlib
import os
import shutil
import sqlite3
import struct

import pytest
import yaml

pytest.importorskip("rosbags")

from backports import zstd

from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError

from . import making

MESSAGES = making.some_messages()
HALF = len(MESSAGES) // 2
DEFINITIONS = """
CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,
  encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL);
"""


def refusal(path, **how):
    with pytest.raises(BagError) as caught:
        read(path, **how)
    text = str(caught.value)
    assert str(path) in text and text.isprintable()
    return text


def told(recording):
    return " ".join(recording.notes)


def counts(recording):
    """How many messages of each kind were read."""
    topics = (recording.wrenches["/wrench"], recording.poses["/pose"], recording.twists["/twist"], recording.journal)
    return [len(topic) for topic in topics]


def contents(folder):
    return {file.name: file.read_bytes() for file in folder.iterdir()}


# The log beside an SQLite file ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("packed", (False, True), ids=("plain", "packed"))
@pytest.mark.parametrize("lone", (False, True), ids=("folder", "file"))
def test_log_beside_the_file_is_read(tmp_path, packed, lone):
    """And nothing of the bag is changed."""
    folder = making.killed(tmp_path / "50% of #1?", MESSAGES)  # a name that is no part of a URI
    (folder / "x_0.db3-shm").unlink()
    if packed:
        (folder / "x_0.db3.zstd").write_bytes(zstd.compress((folder / "x_0.db3").read_bytes()))
        (folder / "x_0.db3").unlink()
    before = contents(folder)
    recording = read(folder / ("x_0.db3.zstd" if packed else "x_0.db3") if lone else folder)
    assert counts(recording) == [20, 20, 20, 20]
    assert "x_0.db3-wal: what its writer had not yet moved to x_0.db3" in told(recording)
    assert contents(folder) == before


@pytest.mark.parametrize("packed", (False, True))
def test_log_is_looked_for_beside_what_a_link_leads_to(tmp_path, packed):
    """As SQLite does: for a link to the file, and for one in a folder."""
    folder, end = making.killed(tmp_path / "bag", MESSAGES), ".zstd" if packed else ""
    if packed:
        (folder / "x_0.db3.zstd").write_bytes(zstd.compress((folder / "x_0.db3").read_bytes()))
    link = tmp_path / "links" / f"link.db3{end}"
    link.parent.mkdir()
    link.symlink_to(folder / f"x_0.db3{end}")
    for path in (link, link.parent):
        recording = read(path)
        assert counts(recording) == [20, 20, 20, 20] and "x_0.db3-wal: what its writer" in told(recording)


def test_log_is_read_where_nothing_can_be_written(tmp_path):
    """As on a read-only medium."""
    folder = making.killed(tmp_path / "bag", MESSAGES)
    for file in folder.iterdir():
        file.chmod(0o444)
    folder.chmod(0o555)
    try:
        assert counts(read(folder)) == [20, 20, 20, 20]
    finally:
        folder.chmod(0o755)


def test_log_beside_one_file_of_several(tmp_path):
    folder = making.killed(tmp_path / "bag", MESSAGES)
    for end in ("", "-wal", "-shm"):
        (folder / f"x_0.db3{end}").rename(folder / f"x_1.db3{end}")
    making.make(tmp_path / "first", [(name, t - 10**9, message) for name, t, message in MESSAGES[:HALF]], "sqlite3")
    (tmp_path / "first" / "first.db3").rename(folder / "x_0.db3")
    assert counts(read(folder)) == [30, 30, 30, 30]


def test_log_that_was_begun_anew_has_older_pages_behind(tmp_path):
    """SQLite overwrites a log whose pages are all in the file: what is left of the older ones is no damage."""
    folder = tmp_path / "bag"
    folder.mkdir()
    with contextlib.closing(sqlite3.connect(tmp_path / "live.db3")) as live:
        live.execute("PRAGMA journal_mode=wal")
        live.executescript(making.TABLES.format(making.QOS))
        making.add(live, MESSAGES[:HALF])
        live.execute("PRAGMA wal_checkpoint(RESTART)")
        making.add(live, MESSAGES[HALF : HALF + 6])
        for end in ("", "-wal"):
            shutil.copyfile(tmp_path / f"live.db3{end}", folder / f"x_0.db3{end}")
    assert counts(read(folder)) == [11, 11, 11, 11]


@pytest.mark.parametrize(
    "damage",
    [
        lambda log: log[:-100],
        lambda log: log[:-4110],
        lambda log: log[:10],
        lambda log: b"?" + log[1:],
        lambda log: log[:16] + b"?" + log[17:],
        lambda log: log[: 32 + 8] + b"?" + log[32 + 9 :],
        lambda log: log[: 32 + 24 + 100] + b"?" + log[32 + 24 + 101 :],
        lambda log: log[: len(log) // 2] + bytes(4120) + log[len(log) // 2 + 4120 :],
    ],
    ids=("cut page", "cut transaction", "cut head", "magic", "salt of head", "salt of page", "page", "zeros"),
)
def test_log_that_is_not_whole_is_refused_or_recovered(tmp_path, damage):
    folder = making.killed(tmp_path / "bag", MESSAGES)
    log = folder / "x_0.db3-wal"
    log.write_bytes(damage(log.read_bytes()))
    assert "x_0.db3-wal: does not end with a whole transaction" in refusal(folder)
    recording = read(folder, recover=True)
    assert 10 <= len(recording.poses["/pose"]) < 20
    assert "x_0.db3-wal does not end with a whole transaction: what is whole in it is taken." in told(recording)


def test_log_of_another_file_is_refused(tmp_path):
    folder = making.killed(tmp_path / "bag", MESSAGES)
    other = making.killed(tmp_path / "other", MESSAGES)
    with contextlib.closing(sqlite3.connect(tmp_path / "small.db3")) as small:
        small.executescript(making.TABLES.format(making.QOS))
        making.add(small, MESSAGES[:1])
    shutil.copyfile(tmp_path / "small.db3", folder / "x_0.db3")
    assert "x_0.db3" in refusal(folder)
    assert counts(read(other)) == [20, 20, 20, 20]


def test_half_a_transaction_is_rolled_back_when_asked_to_recover(tmp_path):
    """Of a recorder without a log, whose pages are in the file before they are committed."""
    folder = tmp_path / "bag"
    folder.mkdir()
    with contextlib.closing(sqlite3.connect(tmp_path / "live.db3", isolation_level=None)) as live:
        live.executescript(f"PRAGMA cache_size=1; {making.TABLES.format(making.QOS)}")
        for _ in range(10):
            making.add(live, MESSAGES[:HALF])
        committed = (tmp_path / "live.db3").read_bytes()
        live.execute("BEGIN")
        live.execute("UPDATE messages SET timestamp = timestamp + 1, data = zeroblob(100)")
        for end in ("", "-journal"):
            shutil.copyfile(tmp_path / f"live.db3{end}", folder / f"x_0.db3{end}")
    assert (folder / "x_0.db3").read_bytes() != committed
    assert "x_0.db3-journal: tells of messages that x_0.db3 has in part" in refusal(folder)
    before = contents(folder)
    recording = read(folder, recover=True)
    assert counts(recording) == [100] * 4 and recording.poses["/pose"].receive_ns[0] == MESSAGES[2][1]
    assert contents(folder) == before
    (folder / "x_0.db3").write_bytes(committed)
    (folder / "x_0.db3-journal").write_bytes(bytes(512))  # as one kind is left after a transaction that was ended
    assert counts(read(folder)) == [100] * 4


def test_what_is_left_without_its_file_is_told(tmp_path):
    folder = making.killed(tmp_path / "bag", MESSAGES)
    (folder / "x_0.db3-wal").rename(folder / "x_1.db3-wal")
    assert "bag: has x_1.db3-wal without x_1.db3" in refusal(folder)
    (folder / "x_1.db3-wal").unlink()
    assert "x_0.db3-shm: is there without x_0.db3-wal, so the last messages may be missing" in refusal(folder)
    recording = read(folder, recover=True)
    assert counts(recording) == [10, 10, 10, 10] and "x_0.db3-shm is there without x_0.db3-wal" in told(recording)
    (folder / "x_0.db3-wal").touch()  # all that it had is in the file
    assert counts(read(folder)) == [10, 10, 10, 10]


# Files and metadata.yaml ----------------------------------------------------------------------------------------------


def split(folder, storage="mcap", **changes):
    """A bag of two files with its description; ``changes`` are made in that."""
    ending = {"mcap": ".mcap", "sqlite3": ".db3"}[storage]
    making.make(folder, MESSAGES, storage)
    described = yaml.safe_load((folder / "metadata.yaml").read_text())
    (folder / f"{folder.name}{ending}").unlink()
    for number, messages in enumerate((MESSAGES[:HALF], MESSAGES[HALF:])):
        making.make(folder / "part", messages, storage)
        (folder / "part" / f"part{ending}").rename(folder / f"x_{number}{ending}")
        shutil.rmtree(folder / "part")
    told = described["rosbag2_bagfile_information"]
    told |= {"relative_file_paths": [f"x_0{ending}", f"x_1{ending}"], **changes}
    (folder / "metadata.yaml").write_text(yaml.safe_dump(described))
    return folder


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_several_files_are_one_bag(tmp_path, storage):
    ending = {"mcap": ".mcap", "sqlite3": ".db3"}[storage]
    for name, files in (("bag", "01"), ("twice", "0101")):  # named twice, they are not read twice
        folder = split(tmp_path / name, storage, relative_file_paths=[f"x_{number}{ending}" for number in files])
        recording = read(folder)
        assert counts(recording) == [20, 20, 20, 20] and recording.notes == []


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_file_that_is_not_named_is_told(tmp_path, storage):
    ending = {"mcap": ".mcap", "sqlite3": ".db3"}[storage]
    folder = split(tmp_path / "bag", storage, relative_file_paths=[f"x_0{ending}"], topics_with_message_count=[])
    said = f"bag: has x_1{ending}, which metadata.yaml does not name; move it away if it is another bag's; --recover"
    assert said in refusal(folder)
    assert counts(read(folder, recover=True)) == [20, 20, 20, 20]


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_file_that_is_not_there_is_told(tmp_path, storage):
    folder = split(tmp_path / "bag", storage)
    (gone,) = folder.glob("x_1.*")
    gone.unlink()
    assert f"bag: lacks {gone.name}, which metadata.yaml names; --recover takes what is whole" in refusal(folder)
    recording = read(folder, recover=True)
    assert counts(recording) == [10, 10, 10, 10] and f"bag lacks {gone.name}" in told(recording)
    (folder / "metadata.yaml").unlink()
    (left,) = folder.glob("x_0.*")
    left.rename(left.with_name(left.name.replace("0", "3")))
    assert "The files are numbered 3: the others are not there." in told(read(folder))


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
def test_other_numbers_of_messages_than_described(tmp_path, storage):
    """Fewer of what is used are a loss; more, or others, are told."""
    folder = split(tmp_path / "bag", storage)
    path = folder / "metadata.yaml"
    described = yaml.safe_load(path.read_text())
    topics = described["rosbag2_bagfile_information"]["topics_with_message_count"]
    of = {entry["topic_metadata"]["name"]: entry for entry in topics}
    of["/pose"]["message_count"], of["/chatter"]["message_count"] = 21, 25
    path.write_text(yaml.safe_dump(described))
    assert "bag: holds 20 of the 21 messages on /pose that metadata.yaml tells of" in refusal(folder)
    recording = read(folder, recover=True)
    assert counts(recording) == [20, 20, 20, 20]
    assert "bag holds 20 of the 21 messages on /pose" in told(recording)
    assert "other messages than metadata.yaml tells of: 20 for 25 on /chatter." in told(recording)
    of["/pose"]["message_count"] = 7
    path.write_text(yaml.safe_dump(described))
    assert "20 for 7 on /pose" in told(read(folder))


@pytest.mark.parametrize("named", ("packed", "plain"))
def test_file_that_is_there_twice_or_otherwise_packed(tmp_path, named):
    """While it packs a file, rosbag2 has both; and somebody may have unpacked one."""
    folder = making.make(tmp_path / "bag", MESSAGES, packed="file" if named == "packed" else None)
    plain, packed = folder / "bag.mcap", folder / "bag.mcap.zstd"
    if named == "packed":
        plain.write_bytes(zstd.decompress(packed.read_bytes()))
    else:
        packed.write_bytes(zstd.compress(plain.read_bytes()))
    recording = read(folder)
    assert counts(recording) == [20, 20, 20, 20]
    other = plain if named == "packed" else packed
    assert f"{other.name} is left out: another file is the same" in told(recording)
    (packed if named == "packed" else plain).unlink()
    recording = read(folder)
    assert counts(recording) == [20, 20, 20, 20] and f"{other.name} is read in place of" in told(recording)
    (folder / "metadata.yaml").unlink()
    plain.write_bytes(zstd.decompress(packed.read_bytes()) if packed.exists() else plain.read_bytes())
    packed.write_bytes(b"half of it")
    recording = read(folder)
    assert counts(recording) == [20, 20, 20, 20] and "bag.mcap.zstd is left out: bag.mcap is the same" in told(
        recording
    )


@pytest.mark.parametrize("name", ("bag.mcap.part", "bag.db3.lz4", "bag_1.mcap~"))
def test_what_looks_like_a_file_of_a_bag_is_told(tmp_path, name):
    folder = making.make(tmp_path / "bag", MESSAGES)
    for there in (name, "README.md", "qos.yaml", "._bag.mcap", ".bag.mcap.swp"):
        (folder / there).write_bytes(b"something")
    assert read(folder).notes == [f"{name} is left out: files of a bag are .mcap or .db3, or packed ones .zstd."]


def test_packed_by_hand(tmp_path):
    folder = making.make(tmp_path / "bag", MESSAGES, "sqlite3")
    (folder / "bag.db3.zst").write_bytes(zstd.compress((folder / "bag.db3").read_bytes()))
    (folder / "bag.db3").unlink()
    assert counts(read(folder)) == [20, 20, 20, 20]
    path = folder / "metadata.yaml"
    path.write_text(path.read_text().replace("bag.db3", "bag.db3.lz4"))
    (folder / "bag.db3.zst").rename(folder / "bag.db3.lz4")
    assert "bag: bag.db3.lz4 is packed in a way that is not known" in refusal(folder)


def test_empty_files(tmp_path):
    folder = split(tmp_path / "bag")
    making.make(tmp_path / "none", [])
    shutil.copyfile(tmp_path / "none" / "none.mcap", folder / "x_2.mcap")
    (folder / "metadata.yaml").unlink()
    assert counts(read(folder)) == [20, 20, 20, 20]
    (folder / "x_3.mcap").touch()
    assert "x_3.mcap: is empty, so it cannot be read; --recover takes" in refusal(folder)
    recording = read(folder, recover=True)
    assert counts(recording) == [20, 20, 20, 20] and "x_3.mcap is empty" in told(recording)


def test_description_is_as_good_as_its_folder(tmp_path):
    assert counts(read(split(tmp_path / "bag") / "metadata.yaml")) == [20, 20, 20, 20]


def test_name_of_a_lone_file_does_not_matter(tmp_path):
    for storage, ending in (("mcap", ".mcap"), ("sqlite3", ".db3")):
        file = making.make(tmp_path / storage, MESSAGES, storage) / f"{storage}{ending}"
        file.rename(tmp_path / f"{storage}.backup")
        assert counts(read(tmp_path / f"{storage}.backup")) == [20, 20, 20, 20]


# Old and new descriptions and tables ----------------------------------------------------------------------------------


def description(version, files, topics):
    """metadata.yaml of a version of rosbag2, as far as the versions differ."""
    described = [
        {
            "topic_metadata": {"name": name, "type": kind, "serialization_format": "cdr"}
            | ({"offered_qos_profiles": "" if version < 9 else []} if version >= 4 else {})
            | ({"type_description_hash": "RIHS01_0"} if version >= 7 else {}),
            "message_count": 20,
        }
        for name, kind in topics.items()
    ]
    told = {
        "version": version,
        "storage_identifier": "sqlite3",
        "relative_file_paths": [name if version >= 4 else f"bag/{name}" for name in files],
        "duration": {"nanoseconds": 1},
        "starting_time": {"nanoseconds_since_epoch": making.EPOCH_NS},
        "message_count": 120,
        "topics_with_message_count": described,
    }
    if version >= 3:
        told |= {"compression_format": "", "compression_mode": ""}
    return yaml.safe_dump({"rosbag2_bagfile_information": told})


@pytest.mark.parametrize("version", (1, 2, 3, 4, 5, 6, 7, 8, 9, 10))
def test_every_version_of_the_description_and_of_the_tables(tmp_path, version):
    """From Dashing, which has neither QoS nor definitions, to Jazzy, which has both and a hash of the type."""
    folder = tmp_path / "bag"
    folder.mkdir()
    with contextlib.closing(sqlite3.connect(folder / "x_0.db3")) as database:
        database.executescript(
            making.TABLES.format((making.QOS if version >= 4 else "") + (making.HASH if version >= 7 else ""))
        )
        if version >= 7:
            database.executescript(DEFINITIONS)
            for kind in ("geometry_msgs/msg/PoseStamped", "std_msgs/msg/String"):  # what rosbag2 finds no text of
                row = (kind, "unknown", "", "")
                database.execute("INSERT INTO message_definitions VALUES (NULL, ?, ?, ?, ?)", row)
        making.add(database, MESSAGES)
    topics = {name: message.__msgtype__ for name, _, message in MESSAGES}
    (folder / "metadata.yaml").write_text(description(version, ["x_0.db3"], topics))
    recording = read(folder)
    assert counts(recording) == [20, 20, 20, 20] and recording.notes == []
    assert recording.types["/chatter"] == "std_msgs/msg/String"


def test_messages_of_a_topic_that_is_not_described(tmp_path):
    """They may be what was asked for: nobody can tell."""
    folder = making.make(tmp_path / "bag", MESSAGES, "sqlite3")
    with contextlib.closing(sqlite3.connect(folder / "bag.db3")) as database, database:
        database.execute("DELETE FROM topics WHERE name = '/pose'")
    assert "20 messages are of topic 3, of which it does not tell" in refusal(folder)


# Kinds of MCAP --------------------------------------------------------------------------------------------------------


def mcap(path, writer=None, encoding="ros2msg", message_encoding="cdr", name=lambda kind: kind, profile="ros2"):
    """A file by another writer than rosbags, with attachments and other records that no bag needs."""
    from mcap.writer import CompressionType, Writer

    options = {"compression": CompressionType.NONE, **(writer or {})}
    channels = {}
    with path.open("wb") as file:
        out = Writer(file, **options)
        out.start(profile=profile, library="test")
        out.add_metadata("about", {"who": "nobody"})
        out.add_attachment(1, 1, "notes", "text/plain", b"written by hand" * 1000)
        for topic, receive_ns, message in MESSAGES:
            kind = message.__msgtype__
            if topic not in channels:
                text = idl(kind) if encoding == "ros2idl" else making.STORE.generate_msgdef(kind, ros_version=2)[0]
                schema = 0 if encoding is None else out.register_schema(name(kind), encoding, text.encode())
                channels[topic] = out.register_channel(topic, message_encoding, schema)
            data = bytes(making.STORE.serialize_cdr(message, kind))
            out.add_message(channels[topic], receive_ns, data, receive_ns)
        out.finish()
    return path


def idl(kind):
    """The definition in IDL as rosbag2 has it where no .msg is found: a part for each type."""
    package, _, last = kind.split("/")
    bodies = {
        "WrenchStamped": "std_msgs::msg::Header header; geometry_msgs::msg::Wrench wrench;",
        "Wrench": "geometry_msgs::msg::Vector3 force; geometry_msgs::msg::Vector3 torque;",
        "PoseStamped": "std_msgs::msg::Header header; geometry_msgs::msg::Pose pose;",
        "TwistStamped": "std_msgs::msg::Header header; geometry_msgs::msg::Twist twist;",
        "String": "string data;",
    }
    return (
        f'{"=" * 80}\nIDL: {kind}\n// generated from nothing\n#include "std_msgs/msg/Header.idl"\n\n'
        f"module {package} {{ module msg {{ struct {last} {{ {bodies[last]} }}; }}; }};\n"
    )


def test_kinds_of_mcap(tmp_path):
    from mcap.writer import CompressionType, IndexType

    kinds = {
        "no chunks": {"writer": {"use_chunking": False}},
        "no chunks, no index": {"writer": {"use_chunking": False, "index_types": IndexType.NONE}},
        "lz4": {"writer": {"compression": CompressionType.LZ4, "chunk_size": 2000}},
        "zstd": {"writer": {"compression": CompressionType.ZSTD, "chunk_size": 2000}},
        "no index": {"writer": {"index_types": IndexType.NONE}},
        "no summary": {
            "writer": {
                "index_types": IndexType.NONE,
                "repeat_channels": False,
                "repeat_schemas": False,
                "use_statistics": False,
                "use_summary_offsets": False,
            }
        },
        "no checksums": {"writer": {"enable_crcs": False}},
        "no profile": {"profile": ""},
        "idl": {"encoding": "ros2idl"},
        "names of ROS 1": {"name": lambda kind: kind.replace("/msg/", "/")},
        "names of IDL": {"name": lambda kind: kind.replace("/", "::")},
        "no definitions": {"encoding": ""},
    }
    for kind, options in kinds.items():
        recording = read(mcap(tmp_path / "file.mcap", **options))
        assert counts(recording) == [20, 20, 20, 20], kind
        assert recording.notes == []


def test_mcap_without_types_or_with_another_encoding_says_what_is_there(tmp_path):
    recording = read(mcap(tmp_path / "file.mcap", encoding=None))
    assert recording.wrenches == {} and recording.types["/wrench"] == ""
    for encoding in ("json", "protobuf", "ros1"):
        said = refusal(mcap(tmp_path / "file.mcap", message_encoding=encoding))
        assert f"is encoded as '{encoding}', which is not known here; give a bag with messages in CDR" in said


def test_mcap_that_has_lost_messages(tmp_path):
    """A chunk is taken out: the end still tells how many messages there were, or nobody tells of their channel."""
    file = mcap(tmp_path / "file.mcap", {"chunk_size": 2000})
    data = file.read_bytes()
    at, chunks = 8, []
    while data[at] != 2:
        (length,) = struct.unpack_from("<Q", data, at + 1)
        if data[at] == 6:
            chunks.append((at, at + 9 + length))
        at += 9 + length
    (begin, end), count = chunks[2], len(chunks)
    assert count > 3
    file.write_bytes(data[:begin] + data[end:])
    assert "messages are there of the 120 that its end tells of" in refusal(file)
    (begin, end) = chunks[0]
    file.write_bytes(data[:begin] + data[end:])
    assert "of which no record before it tells" in refusal(file)


# Kinds of CDR ---------------------------------------------------------------------------------------------------------


def encoded(number, order, most, padding=b""):
    """A WrenchStamped in an encoding: its number, order of bytes and largest alignment."""
    data = bytes((0, number, 0, len(padding)))

    def put(kind, value):
        nonlocal data
        size = struct.calcsize(kind)
        data += bytes(-(len(data) - 4) % min(size, most)) + struct.pack(order + kind, value)

    for kind, value in (("i", 5), ("I", 6), ("I", 6)):
        put(kind, value)
    data += b"world\0"
    for value in range(6):
        put("d", float(value))
    return data + padding


@pytest.mark.parametrize("padding", (b"", b"\0" * 3, b"\0" * 7), ids=("", "3", "7"))
@pytest.mark.parametrize(("number", "order", "most"), [(0, ">", 8), (1, "<", 8), (6, ">", 4), (7, "<", 4)])
def test_encodings_of_cdr(tmp_path, number, order, most, padding):
    """The second version aligns doubles to 4 bytes: taken for the first one, all numbers would be others."""
    message = ("/w", 1, ("geometry_msgs/msg/WrenchStamped", encoded(number, order, most, padding)))
    wrench = read(making.make(tmp_path / "bag", [message])).wrenches["/w"]
    assert wrench.values.tolist() == [[0.0, 1.0, 2.0, 3.0, 4.0, 5.0]]
    assert (wrench.stamp_ns.tolist(), wrench.frame_ids.tolist()) == ([5_000_000_006], ["world"])


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (encoded(3, "<", 8), "it is encoded as PL_CDR; plain CDR would be right"),
        (encoded(9, "<", 4), "it is encoded as D_CDR2"),
        (encoded(0x0B, "<", 4), "it is encoded as PL_CDR2"),
        (encoded(0x42, "<", 8), "it is encoded as 0x0042"),
        (encoded(1, "<", 8, bytes(8)), "it is too long"),
        (encoded(1, "<", 8)[:-1], "it is too short"),
        (encoded(1, "<", 8).replace(b"world", b"wo\0ld"), "it has no text where one must be"),
        (b"", "it is encoded as nothing"),
    ],
)
def test_encodings_that_are_not_known(tmp_path, data, said):
    folder = making.make(tmp_path / "bag", [("/w", 1, ("geometry_msgs/msg/WrenchStamped", data))])
    assert (
        f"message 1 of topic /w, of {len(data)} bytes, is not a serialised geometry_msgs/msg/WrenchStamped: {said}"
        in (refusal(folder))
    )


def test_names_without_even_their_nul(tmp_path):
    data = b"\0\1\0\0" + struct.pack("<iII4x6d", 5, 6, 0, *range(6))
    wrench = read(making.make(tmp_path / "bag", [("/w", 1, ("geometry_msgs/msg/WrenchStamped", data))])).wrenches["/w"]
    assert wrench.values.tolist() == [[0, 1, 2, 3, 4, 5]] and wrench.frame_ids.tolist() == [""]


def test_malformed_commands_that_the_node_has_kept(tmp_path):
    """Its recorder has all that came; with the journal, commands decide nothing."""
    kind = "geometry_msgs/msg/WrenchStamped"
    recording = read(making.make(tmp_path / "bag", [*MESSAGES, ("/wrench", MESSAGES[-1][1] + 9, (kind, b"\0\1\0\0"))]))
    assert counts(recording) == [20, 20, 20, 20]
    assert recording.notes == [f"1 messages on /wrench are no {kind}: left out, as the node does."]


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_folder_that_may_not_be_read(tmp_path):
    folder = making.make(tmp_path / "bag", MESSAGES)
    (folder / "bag.mcap").chmod(0)
    assert "Permission denied" in refusal(folder)
