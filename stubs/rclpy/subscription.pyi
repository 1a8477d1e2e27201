from typing import Any

from rclpy.qos import QoSProfile

class Subscription:
    msg_type: type
    qos_profile: QoSProfile
    @property
    def topic_name(self) -> str: ...
    @property
    def handle(self) -> Any: ...
    def get_publisher_count(self) -> int: ...
