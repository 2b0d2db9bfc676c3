"""Two robots drive through a simulated rescue arena; their scans become one map.

Writes ``logs/``, ``joint.json`` and ``joint.png`` into the folder it runs in.
"""

import mapweave
from mapweave_deploy.sim import simulate

maps = []
for log in simulate("arena", robots=2, seed=1, folder="logs"):
    mapper = mapweave.Mapper(log.robot)
    for scan in mapweave.read_scans(log.log):
        mapper.add(scan)
    maps.append(mapper.finish())
alignments = mapweave.align(maps[0], maps[1])
joint = mapweave.fuse(maps, alignments)
mapweave.save(joint, "joint.json")
mapweave.plot(joint, "joint.png")
