from rclpy.qos import QoSProfile

class Subscription:
    msg_type: type
    qos_profile: QoSProfile
    @property
    def topic_name(self) -> str: ...
    def get_publisher_count(self) -> int: ...
