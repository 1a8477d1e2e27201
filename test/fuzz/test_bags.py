"""Bags with damage: read, or refused in one sentence; never half of it as if it were all."""

import shutil

import numpy as np
import pytest

pytest.importorskip("rosbags")

from rigid_body_sim.bags import journal
from rigid_body_sim.bags.reading import read
from rigid_body_sim.bags.rosbags_support import BagError

from ..bags import making
from .fuzzing import damaged, fuzz, sentence

MESSAGES = making.some_messages()
KINDS = [("mcap", None), ("sqlite3", None), ("mcap", "file"), ("mcap", "message"), ("sqlite3", "message")]


@pytest.fixture(scope="module")
def bags(tmp_path_factory):
    """Bytes of each file of a bag, by name, for each of KINDS and of a recorder that was killed."""
    found = []
    for place, (storage, packed) in enumerate(KINDS):
        folder = making.make(tmp_path_factory.mktemp("bags") / f"bag{place}", MESSAGES, storage, packed)
        found.append(folder)
    found.append(making.killed(tmp_path_factory.mktemp("bags") / "killed", MESSAGES))
    return [{file.name: file.read_bytes() for file in sorted(folder.iterdir())} for folder in found]


def check_recording(recording):
    """What is read hangs together, whatever it is."""
    for topics in (recording.wrenches, recording.poses, recording.twists):
        for messages in topics.values():
            assert len(messages.values) == len(messages.receive_ns) == len(messages.stamp_ns) == len(messages.frame_ids)
            assert (np.diff(messages.receive_ns) >= 0).all()
    try:
        journal.read(recording.journal)
    except BagError as reason:
        sentence(reason)


def test_damaged_files(record_property, bags, tmp_path):
    taken, refused = [], []

    def make(chance):
        files = dict(chance.choice(bags))
        for _ in range(chance.choice((1, 1, 1, 2))):
            name = chance.choice(list(files))
            files[name] = damaged(chance, files[name])
        if chance.random() < 0.2:
            del files[chance.choice(list(files))]
        return files, chance.random() < 0.5

    def check(case):
        files, recover = case
        folder = tmp_path / "bag"
        shutil.rmtree(folder, ignore_errors=True)
        folder.mkdir()
        for name, data in files.items():
            (folder / name).write_bytes(data)
        try:
            recording = read(folder, recover=recover)
        except BagError as reason:
            assert str(folder) in sentence(reason)
            refused.append(True)
            return
        check_recording(recording)
        taken.append(True)

    fuzz(record_property, check, make, 60)
    assert taken and refused
