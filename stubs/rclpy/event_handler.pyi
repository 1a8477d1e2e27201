from collections.abc import Callable

class QoSPublisherMatchedInfo:
    current_count: int

class UnsupportedEventTypeError(RuntimeError): ...

class PublisherEventCallbacks:
    def __init__(self, *, matched: Callable[[QoSPublisherMatchedInfo], None] | None = None) -> None: ...
