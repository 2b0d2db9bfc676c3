"""ROS 2 over Zenoh, without ROS: what `rmw_zenoh` and `zenoh-bridge-ros2dds` say, heard and said.

``ros2:/scan`` is a source of scans (`source`); messages are decoded by the definitions that
`rosbags` brings, the extra ``ros2``. No node, no workspace and no distribution is needed.
"""
