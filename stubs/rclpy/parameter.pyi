import enum
from typing import Any

class Parameter:
    class Type(enum.Enum):
        NOT_SET = 0
        INTEGER = 2
        STRING = 4
        INTEGER_ARRAY = 7
        DOUBLE_ARRAY = 8
        STRING_ARRAY = 9

    def __init__(self, name: str, type_: Type | None = None, value: Any = None) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def type_(self) -> Type: ...
    @property
    def value(self) -> Any: ...
