"""Map a laser log scan by scan: ``python map_a_log.py LOG MAP.json ROBOT``.

A robot's own program does the same with its scans as they come, for instance with
``mapweave.Scan.of(msg.ranges, msg.angle_min, msg.angle_increment, stamp=stamp)``.
"""

import sys

import mapweave

if len(sys.argv) != 4:
    raise SystemExit("usage: python map_a_log.py LOG MAP.json ROBOT")
log, output, robot = sys.argv[1:]
try:
    mapper = mapweave.Mapper(robot)
    for scan in mapweave.read_scans(log):
        outcome = mapper.add(scan)
        if outcome.lost:
            print(f"scan {scan.index} fits nowhere: component {outcome.component} begins")
        if outcome.submap_finished:
            robot_map = mapper.robot_map()  # what is known so far, at any time
            walls = sum(len(submap.map.segments) for submap in robot_map.submaps)
            print(f"scan {scan.index}: a submap is finished, {walls} segments in all")

    robot_map = mapper.finish()
    mapweave.save(robot_map, output)
except mapweave.MapweaveError as error:  # such as that there is no such log: its text says all
    raise SystemExit(str(error)) from None
for component in robot_map.components:
    lines = robot_map.lines(component)  # in the component's frame, submaps side by side
    print(f"component {component}: {len(lines.segments)} segments")
