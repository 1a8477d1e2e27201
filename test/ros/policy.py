"""The SROS2 policy in security/, as the full names that a node in a namespace may use."""

import time
from dataclasses import dataclass
from xml.etree import ElementTree

from .node_process import ROOT
from .remote import SECONDS

FILE = ROOT / "security/rigid_body_sim.policy.xml"
ACTION_SERVICES = ("send_goal", "cancel_goal", "get_result")
ACTION_TOPICS = ("feedback", "status")
KINDS = ("publish", "subscribe", "reply")


@dataclass(frozen=True)
class Names:
    """Full names of topics and services."""

    publish: frozenset[str]
    subscribe: frozenset[str]
    reply: frozenset[str]

    def only(self, wanted):
        """Those of each kind for which ``wanted(name)``."""
        return Names(*(frozenset(filter(wanted, getattr(self, what))) for what in KINDS))


NOTHING = Names(*[frozenset()] * 3)


def allowed(node, namespace):
    """What the policy allows a node of that name, were its profile one of that namespace."""
    (profile,) = ElementTree.parse(FILE).iterfind(f".//profile[@node='{node}']")

    def named(kind, permission):
        found = profile.iterfind(f"{kind}s[@{permission}='ALLOW']/{kind}")
        return {_full(element.text, node, namespace) for element in found}

    actions = named("action", "execute")
    return Names(
        frozenset(named("topic", "publish") | {f"{name}/_action/{end}" for name in actions for end in ACTION_TOPICS}),
        frozenset(named("topic", "subscribe")),
        frozenset(named("service", "reply") | {f"{name}/_action/{end}" for name in actions for end in ACTION_SERVICES}),
    )


def _full(name, node, namespace):
    if name.startswith("/"):
        return name
    return f"{namespace}/{node}{name[1:]}" if name.startswith("~") else f"{namespace}/{name}"


def used(observer, node, namespace, least):
    """What the network says that a node uses, once that is no less than ``least``; it learns of one after the other."""
    deadline = time.monotonic() + SECONDS
    while True:
        try:
            found = _used(observer, node, namespace)
        except RuntimeError:  # the node is not known yet
            found = NOTHING
        if all(getattr(least, what) <= getattr(found, what) for what in KINDS):
            return found
        assert time.monotonic() < deadline, f"{node} is known to use only {found}, not {least}"
        time.sleep(0.05)


def _used(observer, node, namespace):
    return Names(
        *(
            frozenset(name for name, _ in ask(node, namespace))
            for ask in (
                observer.get_publisher_names_and_types_by_node,
                observer.get_subscriber_names_and_types_by_node,
                observer.get_service_names_and_types_by_node,
            )
        )
    )
