"""The SROS2 policy in security/, as the full names that a node in a namespace may use."""

from dataclasses import dataclass
from xml.etree import ElementTree

from .node_process import ROOT

FILE = ROOT / "security/rigid_body_sim.policy.xml"
ACTION_SERVICES = ("send_goal", "cancel_goal", "get_result")
ACTION_TOPICS = ("feedback", "status")


@dataclass(frozen=True)
class Names:
    """Full names of topics and services."""

    publish: frozenset[str]
    subscribe: frozenset[str]
    reply: frozenset[str]


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


def used(observer, node, namespace):
    """What the network says that a node uses."""
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
