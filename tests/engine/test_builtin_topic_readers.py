"""Readers of DCPSParticipant, DCPSPublication, DCPSSubscription: what discovery learns, as samples.  DDS 1.4 §2.2.5."""

from __future__ import annotations

import pytest

from ddsi.engine import BuiltinTopicChange, DataAvailable, LocalBuiltinTopicReader, Participant
from ddsi.simulation import Domain
from ddsi.spi import PENDING, Admission, Decided, HookEffect, Refused
from ddsi.spi.plaintext import Plaintext
from ddsi.structure.builtin_topic_data import (
    ParticipantBuiltinTopicData,
    PublicationBuiltinTopicData,
    SubscriptionBuiltinTopicData,
    TopicBuiltinTopicData,
)
from ddsi.structure.discovered import DiscoveredParticipantData, DiscoveredReaderData, DiscoveredWriterData
from ddsi.structure.guid import Guid
from ddsi.structure.qos import Qos
from ddsi.structure.qos_policies import DataTags, Partition, Reliable, UserData
from ddsi.structure.sample_info import InstanceState
from ddsi.structure.security_information import EndpointSecurity, ParticipantSecurity
from tests.engine.wire import VENDOR, Stranger, engine

KINDS = (ParticipantBuiltinTopicData, PublicationBuiltinTopicData, SubscriptionBuiltinTopicData)
ALIVE, DISPOSED = InstanceState.ALIVE, InstanceState.NOT_ALIVE_DISPOSED
NO_WRITERS = InstanceState.NOT_ALIVE_NO_WRITERS


SecuredData = ParticipantBuiltinTopicData | PublicationBuiltinTopicData | SubscriptionBuiltinTopicData


def taken(reader: LocalBuiltinTopicReader) -> list[tuple[SecuredData, InstanceState]]:
    """What is new in it: the data, and what became of the instance."""
    reader.history.seen()
    found = []
    for info, change in reader.history.take():
        assert isinstance(change, BuiltinTopicChange)
        assert not isinstance(change.data, TopicBuiltinTopicData), "topics have readers of another kind"
        assert info.instance_handle == change.data.key
        assert info.publication_handle == change.data.key.participant
        found.append((change.data, info.instance_state))
    return found


def states(reader: LocalBuiltinTopicReader) -> list[tuple[Guid, InstanceState]]:
    return [(data.key, state) for data, state in taken(reader)]


def readers(participant: Participant) -> list[LocalBuiltinTopicReader]:
    return [participant.builtin_readers.create(kind, 0.0) for kind in KINDS]


def with_stranger() -> tuple[Participant, Stranger]:
    """It has a writer and a reader."""
    participant, stranger = engine(), Stranger()
    stranger.introduce(participant, user_data=b"hello", entity_name="stranger")
    writer = stranger.sedp_writer(qos=Qos(reliability=Reliable(), data_tags=DataTags(("colour", "red"))))
    participant.receive_datagram(writer, stranger.address, 0.0)
    subscription = stranger.sedp_reader(qos=Qos(partition=Partition("there"), user_data=UserData(b"reads")))
    participant.receive_datagram(subscription, stranger.address, 0.0)
    return participant, stranger


# --- what is there --------------------------------------------------------------------------------------------------


def test_each_reader_has_its_own_kind_of_entity_and_all_that_was_announced_of_it() -> None:
    participant, stranger = with_stranger()
    participants, publications, subscriptions = readers(participant)
    ((who, _),) = taken(participants)
    assert who == ParticipantBuiltinTopicData(
        key=stranger.guid,
        user_data=b"hello",
        entity_name="stranger",
        vendor_id=VENDOR,
        protocol_version=(2, 4),
        domain_id=None,
        lease_duration=20.0,
        properties=(),
        security=ParticipantSecurity(),
    )
    ((publication, _),) = taken(publications)
    assert isinstance(publication, PublicationBuiltinTopicData)
    assert (publication.key, publication.participant_key) == (stranger.endpoint(1, is_writer=True), stranger.guid)
    assert (publication.topic_name, publication.type_name) == ("Square", "T")
    assert publication.qos.is_reliable
    assert publication.data_tags == (("colour", "red"),)
    assert publication.security == EndpointSecurity()
    ((subscription, _),) = taken(subscriptions)
    assert isinstance(subscription, SubscriptionBuiltinTopicData)
    assert (subscription.key, subscription.participant_key) == (stranger.endpoint(1, is_writer=False), stranger.guid)
    assert (subscription.qos.partition.names, subscription.user_data) == (("there",), b"reads")
    assert subscription.content_filter is None


def test_one_that_comes_early_has_the_same_as_one_that_comes_late() -> None:
    participant, stranger = engine(), Stranger()
    early = readers(participant)
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_writer(), stranger.address, 0.0)
    participant.receive_datagram(stranger.sedp_reader(), stranger.address, 0.0)
    for one, other in zip(early, readers(participant), strict=True):
        found = taken(one)
        assert found == taken(other)
        assert len(found) == 1


def test_what_changes_is_told_and_what_is_only_said_again_is_not() -> None:
    participant, stranger = with_stranger()
    participants, publications, _ = readers(participant)
    taken(participants)
    taken(publications)
    for user_data in (b"hello", b"hello again", b"hello again"):
        participant.receive_datagram(stranger.spdp(user_data=user_data, entity_name="stranger"), stranger.address, 1.0)
    ((who, state),) = taken(participants)
    assert isinstance(who, ParticipantBuiltinTopicData)
    assert (who.user_data, state) == (b"hello again", ALIVE)
    for _ in range(2):
        moved = stranger.sedp_writer(qos=Qos(partition=Partition("elsewhere")))
        participant.receive_datagram(moved, stranger.address, 1.0)
    ((publication, _),) = taken(publications)
    assert isinstance(publication, PublicationBuiltinTopicData)
    assert publication.qos.partition.names == ("elsewhere",)


def test_it_holds_the_latest_of_each_entity_only() -> None:
    participant, stranger = engine(), Stranger()
    participants, _, _ = readers(participant)
    for number in range(5):
        participant.receive_datagram(stranger.spdp(user_data=b"%d" % number), stranger.address, 0.0)
    ((who, _),) = taken(participants)
    assert isinstance(who, ParticipantBuiltinTopicData)
    assert who.user_data == b"4"


def test_whoever_waits_is_woken() -> None:
    participant, stranger = engine(), Stranger()
    participants, publications, _ = readers(participant)
    stranger_spdp = stranger.spdp()
    participant.receive_datagram(stranger_spdp, stranger.address, 0.0)
    woken = [effect.reader for effect in participant.drain_effects() if isinstance(effect, DataAvailable)]
    assert woken == [participants.guid]
    assert participants.guid != publications.guid


def test_our_own_entities_are_not_reported() -> None:
    """DDS 1.4 §2.2.5: whoever made them knows of them."""
    domain = Domain()
    node, other = domain.node(), domain.node()
    node.writer("Square")
    node.reader("Square")
    found = readers(node.engine)
    domain.run(2.0)
    assert [states(reader) for reader in found] == [[(other.guid, ALIVE)], [], []]


def test_what_nobody_reads_any_more_is_not_kept() -> None:
    participant, stranger = engine(), Stranger()
    participants, publications, _ = readers(participant)
    participant.builtin_readers.delete(participants)
    participant.builtin_readers.delete(participants)
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_writer(), stranger.address, 0.0)
    assert (len(participants.history), len(publications.history)) == (0, 1)


# --- the end --------------------------------------------------------------------------------------------------------


def test_who_says_goodbye_is_disposed_and_its_endpoints_have_no_writers() -> None:
    participant, stranger = with_stranger()
    found = readers(participant)
    before = [taken(reader) for reader in found]
    participant.receive_datagram(stranger.goodbye(), stranger.address, 1.0)
    ends = [taken(reader) for reader in found]
    assert [state for ((_, state),) in ends] == [DISPOSED, NO_WRITERS, NO_WRITERS]
    assert [data for ((data, _),) in ends] == [data for ((data, _),) in before], "what was known of it last"
    assert [len(reader.history.instances) for reader in found] == [0, 0, 0]


def test_an_endpoint_that_its_participant_deletes_is_disposed() -> None:
    domain = Domain()
    node, other = domain.node(), domain.node()
    _, publications, subscriptions = readers(node.engine)
    reader = other.reader("Square", Qos(reliability=Reliable()))
    domain.run(2.0)
    assert states(subscriptions) == [(reader.guid, ALIVE)]
    reader.delete()
    domain.run(2.0)
    assert (states(subscriptions), states(publications)) == ([(reader.guid, DISPOSED)], [])


def test_who_falls_silent_has_no_writers_when_its_lease_has_run_out() -> None:
    participant, stranger = with_stranger()
    participants, publications, _ = readers(participant)
    taken(participants)
    taken(publications)
    participant.handle_timeout(19.0)
    assert (taken(participants), taken(publications)) == ([], [])
    participant.handle_timeout(20.1)
    assert states(participants) == [(stranger.guid, NO_WRITERS)]
    assert states(publications) == [(stranger.endpoint(1, is_writer=True), NO_WRITERS)]


def test_who_comes_back_lives_in_another_generation() -> None:
    participant, stranger = engine(), Stranger()
    participants, _, _ = readers(participant)
    stranger.introduce(participant)
    participant.receive_datagram(stranger.goodbye(), stranger.address, 1.0)
    stranger.introduce(participant, 3.0)
    infos = [info for info, _ in participants.history.read()]
    assert [(info.valid_data, info.disposed_generation_count) for info in infos] == [(False, 0), (True, 1)]
    assert {info.instance_state for info in infos} == {ALIVE}


def test_whom_the_application_ignores_is_gone() -> None:
    participant, stranger = with_stranger()
    participants, publications, _ = readers(participant)
    taken(participants)
    taken(publications)
    participant.discovery.ignore(stranger.guid, 1.0)
    participant.receive_datagram(stranger.spdp(), stranger.address, 2.0)
    assert [state for _, state in states(participants)] == [NO_WRITERS]
    assert [state for _, state in states(publications)] == [NO_WRITERS]


def test_strangers_that_come_and_go_do_not_fill_the_memory_of_one_that_nobody_reads() -> None:
    participant, resident = with_stranger()
    participants, _, _ = readers(participant)
    for number in range(2, 1502):
        stranger = Stranger(number)
        participant.receive_datagram(stranger.spdp(), stranger.address, 1.0)
        participant.receive_datagram(stranger.goodbye(), stranger.address, 1.0)
        participant.drain_effects()
    history = participants.history
    assert len(participants.known) == 1
    assert len(history.instances) == 1025
    assert len(history) == 2 * 1024 + 1, "the data and the end of each"
    found = states(participants)
    assert found[0] == (resident.guid, ALIVE)
    assert found[-1] == (Stranger(1501).guid, DISPOSED)


# --- what security says ---------------------------------------------------------------------------------------------


class Hooks(Plaintext):
    """Admits as a test says; knows everybody as Alice, and counts how often it is asked."""

    def __init__(self, admission: Admission) -> None:
        self.admission = admission
        self.effects: list[HookEffect] = []
        self.asked = 0
        self.subject_name = "CN=alice"

    def remote_participant(self, data: DiscoveredParticipantData, now: float) -> Admission:
        return self.admission

    def remote_participant_changed(self, data: DiscoveredParticipantData, now: float) -> Admission:
        return self.admission

    def drain_effects(self) -> list[HookEffect]:
        effects, self.effects = self.effects, []
        return effects

    def participant_security(self, participant: Guid) -> ParticipantSecurity:
        self.asked += 1
        return ParticipantSecurity(is_authenticated=True, subject_name=self.subject_name)

    def endpoint_security(self, endpoint: DiscoveredWriterData | DiscoveredReaderData) -> EndpointSecurity:
        self.asked += 1
        return EndpointSecurity(is_authenticated=True, subject_name=self.subject_name, is_payload_protected=True)


@pytest.mark.parametrize("admission", [PENDING, Refused("not one of ours")])
def test_who_is_not_admitted_is_not_shown_before_he_is(admission: Admission) -> None:
    hooks = Hooks(admission)
    participant, stranger = engine(hooks=hooks), Stranger()
    participants, publications, _ = early = readers(participant)
    stranger.introduce(participant)
    participant.receive_datagram(stranger.spdp(user_data=b"let me in"), stranger.address, 0.5)
    participant.receive_datagram(stranger.sedp_writer(), stranger.address, 0.5)
    assert [taken(reader) for reader in (*early, *readers(participant))] == [[]] * 6
    hooks.admission = Plaintext().remote_participant(stranger.data(), 1.0)
    hooks.effects.append(Decided(participant.guid, stranger.guid, hooks.admission))
    participant.drain_effects()
    ((who, _),) = taken(participants)
    assert isinstance(who, ParticipantBuiltinTopicData)
    assert (who.user_data, who.security.subject_name) == (b"let me in", "CN=alice")
    assert taken(publications) == []


def test_whom_security_refuses_later_has_no_writers() -> None:
    hooks = Hooks(Plaintext().remote_participant(Stranger().data(), 0.0))
    participant, stranger = engine(hooks=hooks), Stranger()
    participants, _, _ = readers(participant)
    stranger.introduce(participant)
    hooks.effects.append(Decided(participant.guid, stranger.guid, Refused("its certificate ended")))
    participant.drain_effects()
    ((who, state),) = taken(participants)[1:]
    assert state is NO_WRITERS
    assert who.security.subject_name == "CN=alice", "as it was known"


def test_who_authenticates_anew_is_told_as_changed_if_he_is_another() -> None:
    admitted = Plaintext().remote_participant(Stranger().data(), 0.0)
    hooks = Hooks(admitted)
    participant, stranger = engine(hooks=hooks), Stranger()
    participants, _, _ = readers(participant)
    stranger.introduce(participant)
    taken(participants)
    for subject_name, expected in (("CN=alice", []), ("CN=alice,O=Navy", ["CN=alice,O=Navy"])):
        hooks.subject_name = subject_name
        hooks.effects.append(Decided(participant.guid, stranger.guid, admitted))
        participant.drain_effects()
        assert [data.security.subject_name for data, _ in taken(participants)] == expected


def test_without_a_reader_nobody_asks_and_nothing_is_made() -> None:
    hooks = Hooks(Plaintext().remote_participant(Stranger().data(), 0.0))
    participant, stranger = engine(hooks=hooks), Stranger()
    stranger.introduce(participant)
    participant.receive_datagram(stranger.sedp_writer(), stranger.address, 0.0)
    participant.receive_datagram(stranger.goodbye(), stranger.address, 0.0)
    assert hooks.asked == 0
