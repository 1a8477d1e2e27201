# Debian with rclpy from PyPI and the kernels compiled in, so that the node starts within a second or two.
#
#   docker build -t rigid_body_sim .                            (--build-arg ROS=kilted for Kilted's rclpy)
#   docker run --rm --network=host --ipc=host rigid_body_sim --ros-args --params-file /opt/rigid_body_sim/share/rigid_body_sim/config/quadrotor.yaml
#
# Host network and host IPC let programs outside the container find the node and share memory with it.
FROM debian:bookworm-slim AS build
ARG ROS=jazzy
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3-venv \
    && rm -rf /var/lib/apt/lists/* \
    && python3 -m venv /opt/rigid_body_sim
COPY . /src
RUN /opt/rigid_body_sim/bin/pip install --no-cache-dir "/src[ros-${ROS},fast,bag]"

FROM debian:bookworm-slim
# hadolint ignore=DL3008
RUN apt-get update \
    && apt-get install --yes --no-install-recommends python3 \
    && rm -rf /var/lib/apt/lists/* \
    && useradd --create-home ros
COPY --from=build /opt/rigid_body_sim /opt/rigid_body_sim
# For any processor since 2013, not just the one on which the image is built. What is compiled belongs to root: the node
# trusts it, and cannot change it.
ENV PATH=/opt/rigid_body_sim/bin:$PATH \
    NUMBA_CACHE_DIR=/var/cache/numba \
    NUMBA_CPU_NAME=x86-64-v3 \
    NUMBA_CPU_FEATURES=
RUN rigid_body_node --compile && chmod -R go+rX /var/cache/numba
USER ros
WORKDIR /home/ros
ENTRYPOINT ["rigid_body_node"]
