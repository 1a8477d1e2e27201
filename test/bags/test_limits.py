"""Small files that claim, or unpack to, very much are refused with the claim and the limit, before memory is taken."""

import struct

import pytest

pytest.importorskip("rosbags")

from backports import zstd
from lz4 import frame as lz4

from rigid_body_sim.bags import description, unpacking
from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError

from . import making

MESSAGES = making.some_messages()
MUCH = 2**31


def refusal(path):
    with pytest.raises(BagError) as caught:
        read(path)
    text = str(caught.value)
    assert str(path) in text and text.isprintable() and len(text) < 600
    return text


def record(kind, data):
    return struct.pack("<BQ", kind, len(data)) + data


def text(data):
    return struct.pack("<I", len(data)) + data


def with_chunk(path, claimed, packing, packed):
    """An MCAP file with one chunk."""
    chunk = struct.pack("<QQQI", 0, 0, claimed, 0) + text(packing) + struct.pack("<Q", len(packed)) + packed
    head, end = record(1, text(b"ros2") + text(b"")), record(2, bytes(20))
    path.write_bytes(b"\x89MCAP0\r\n" + head + record(6, chunk) + end + b"\x89MCAP0\r\n")
    return path


def zeros(count):
    """So many of them, packed; the frame does not tell how many."""
    packer, block = zstd.ZstdCompressor(), bytes(2**24)
    return b"".join([packer.compress(block) for _ in range(count // len(block))]) + packer.flush()


def test_chunk_that_claims_too_much(tmp_path):
    for packing in (b"zstd", b"lz4", b""):
        said = refusal(with_chunk(tmp_path / "b.mcap", MUCH, packing, b"little"))
        assert f"a chunk claims {MUCH} bytes; at most {unpacking.MOST_AT_ONCE} are taken" in said


@pytest.mark.parametrize("claimed", (0, 1000, 2**28))
def test_chunk_that_unpacks_to_more_or_less_than_it_claims(tmp_path, monkeypatch, claimed):
    """What is beyond the claim is never unpacked: 2 GB, of 65 kB, would be."""
    monkeypatch.setattr(unpacking, "zlib", None)  # a checksum of it is not formed, either
    packed = zeros(MUCH)
    assert len(packed) < 300_000
    said = refusal(with_chunk(tmp_path / "b.mcap", claimed, b"zstd", packed))
    assert f"a chunk claims {claimed} bytes and has more than {claimed}" in said
    if claimed == 1000:
        packed = lz4.compress(bytes(2**24))
        assert "claims 1000 bytes and has more" in refusal(with_chunk(tmp_path / "b.mcap", 1000, b"lz4", packed))
        for packing, packed in ((b"zstd", zstd.compress(b"123")), (b"lz4", lz4.compress(b"123")), (b"", b"123")):
            said = refusal(with_chunk(tmp_path / "b.mcap", 1000, packing, packed))
            assert "a chunk claims 1000 bytes and has 3" in said


def test_chunk_without_an_end(tmp_path):
    for packing, packed in ((b"zstd", zstd.compress(bytes(1000))), (b"lz4", lz4.compress(bytes(1000)))):
        said = refusal(with_chunk(tmp_path / "b.mcap", 1000, packing, packed[:-6]))
        assert "a chunk" in said


@pytest.mark.parametrize("claims", (False, True))
def test_packed_file_that_is_too_large(tmp_path, monkeypatch, claims):
    if claims:
        packer = zstd.ZstdCompressor()
        packer.set_pledged_input_size(MUCH)
        packed, size, most = packer.compress(bytes(2**20)) + packer.flush(packer.FLUSH_BLOCK), MUCH, 2**30
    else:
        monkeypatch.setattr(unpacking, "MOST_OF_FILE", 2**20)
        packed, size = zeros(2**26), "more than"
        most = max(2**20, 1000 * len(packed))
        size = f"more than {most}"
    (tmp_path / "b.mcap.zstd").write_bytes(packed)
    said = refusal(tmp_path / "b.mcap.zstd")
    assert f"b.mcap.zstd: it has {len(packed)} bytes and unpacks to {size}; at most {most} are taken" in said


@pytest.mark.parametrize("storage", ("mcap", "sqlite3"))
@pytest.mark.parametrize("claims", (False, True))
def test_packed_message_that_is_too_large(tmp_path, storage, claims):
    packed = zstd.compress(bytes(2**27)) if claims else zeros(2**27)
    message = ("/pose", 1, ("geometry_msgs/msg/PoseStamped", packed))
    said = refusal(making.make(tmp_path / "bag", [message], storage))
    assert f"{2**27} bytes; at most" in said if claims else f"more than {unpacking.MOST_MESSAGE} bytes" in said


def test_message_of_a_database_that_is_too_large(tmp_path):
    """Told from its length, without reading it."""
    message = ("/pose", 1, ("geometry_msgs/msg/PoseStamped", bytes(2**24 + 1)))
    assert "a message on /pose claims 16777217 bytes; at most 16777216" in refusal(
        making.make(tmp_path / "bag", [message], "sqlite3")
    )


def test_record_that_is_too_large(tmp_path, monkeypatch):
    monkeypatch.setattr(unpacking, "MOST_AT_ONCE", 1000)
    monkeypatch.setattr(unpacking.check_size, "__defaults__", (1000,))
    assert "a record claims " in refusal(making.make(tmp_path / "bag", MESSAGES) / "bag.mcap")


BOMB = "a: &a [x, x, x, x, x, x, x, x, x]\n" + "".join(
    f"{b}: &{b} [{', '.join(f'*{a}' for _ in range(9))}]\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)
MERGED = "a: &a {k: 1}\n" + "".join(
    f"{b}: &{b} {{<<: [{', '.join(f'*{a}' for _ in range(9))}]}}\n" for a, b in zip("abcdefgh", "bcdefghi", strict=True)
)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        ("#" * 5_000_000, f"metadata.yaml has 5000000 bytes; at most {description.MOST_BYTES} are read"),
        (BOMB, "metadata.yaml has an alias (*name), which rosbag2 does not write"),
        (MERGED, "metadata.yaml has an alias (*name), which rosbag2 does not write"),
        ("[" * 1_000_000, "metadata.yaml"),
        ("{a: " * 100, "metadata.yaml is nested too deeply"),
        ("rosbag2_bagfile_information: 5", "metadata.yaml is not as rosbag2 writes it"),
        ("rosbag2_bagfile_information: {relative_file_paths: 5}", "a int in place of a list"),
        ("rosbag2_bagfile_information: {relative_file_paths: [{}]}", "a dict in place of a str"),
        ("rosbag2_bagfile_information: {}", "metadata.yaml is not as rosbag2 writes it (KeyError)"),
        ("a: \udcff", "metadata.yaml"),
        (f"rosbag2_bagfile_information: {{relative_file_paths: [], version: {'1' * 10_000}}}", "metadata.yaml"),
    ],
    ids=(
        "huge",
        "aliases",
        "merged",
        "deep",
        "deep maps",
        "number",
        "no list",
        "no names",
        "empty",
        "no text",
        "digits",
    ),
)
def test_descriptions_that_grow_or_are_none(tmp_path, content, said):
    folder = making.make(tmp_path / "bag", MESSAGES)
    (folder / "metadata.yaml").write_bytes(content.encode(errors="surrogateescape"))
    assert said in refusal(folder)


def test_definition_that_is_too_long_or_cannot_be_read(tmp_path):
    kind = "geometry_msgs/msg/PoseStamped"
    pose = [message for message in MESSAGES if message[0] == "/pose"]
    folder = making.make(tmp_path / "long", pose, definitions={kind: "#" * 200_000})
    assert f"the definition of {kind} has 200000 characters; at most 100000 are read" in refusal(folder)
    recording = read(making.make(tmp_path / "odd", pose, definitions={kind: "?!?"}))
    assert len(recording.poses["/pose"]) == 20
    assert recording.notes == [f"The definition of {kind} in the bag cannot be read: that of ROS 2 Jazzy is taken."]


def test_journal_that_is_nested_too_deeply(tmp_path):
    from rigid_body_sim.bags import journal

    recording = read(making.make(tmp_path / "bag", [("/n/journal", 1, making.text("[" * 1_000_000))]))
    with pytest.raises(BagError, match="entry 0 of the journal is not as rigid_body_node writes it"):
        journal.read(recording.journal)
