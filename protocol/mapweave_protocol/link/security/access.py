"""The router's access rules, from the roster: who may publish, answer and be present as whom.

Everybody of the team may read all of it; to write, each has keys of its own. Beside these keys come
those that Zenoh's advanced publishers and subscribers use to heal (``…/@adv/**``): no ``**`` takes
in a chunk that begins with ``@``, so each is named. Denied is denied in silence.
"""

from mapweave_protocol.link.security.roster import Member, Role, Roster
from mapweave_protocol.wire.keys import ALIGNMENT, JOINT_STATUS, POSE, STATUS, everything

WRITING = ("put", "delete", "reply", "declare_queryable", "liveliness_token")
READING = ("declare_subscriber", "query", "liveliness_query", "declare_liveliness_subscriber")
HEALING = "@adv/**"
SMALL, LARGE = 64 * 2**10, 4 * 2**20  # [bytes] of one message


def access_rules(roster: Roster) -> dict[str, object]:
    """Return what goes into the router's configuration under ``access_control``."""
    rules = [_reading(roster.team), _delivering(roster.team)]
    subjects, policies = [], []
    for member in roster.members:
        name = member.common_name
        subjects.append({"id": name, "cert_common_names": [name]})
        mine = _writing(member)
        rules += mine
        allowed = ["reading", "delivering", *(str(rule["id"]) for rule in mine)]
        policies.append({"rules": allowed, "subjects": [name]})
    return {
        "enabled": True,
        "default_permission": "deny",
        "rules": rules,
        "subjects": subjects,
        "policies": policies,
    }


def size_limits(team: str) -> list[dict[str, object]]:
    """Return what goes there under ``low_pass_filter``: no small message of a robot is large."""
    middle = (
        STATUS.pattern(team=team),
        ALIGNMENT.pattern(team=team),
        JOINT_STATUS.build(team=team),
    )
    limited = {SMALL: [POSE.pattern(team=team)], LARGE: list(middle)}
    return [
        {
            "id": f"at-most-{size}",
            "flows": ["ingress"],
            "messages": ["put", "reply"],
            "key_exprs": keys,
            "size_limit": size,
        }
        for size, keys in limited.items()
    ]


def own_keys(member: Member) -> tuple[str, ...]:
    """Return the key expressions that a member may write, without those for healing."""
    root, name = everything(member.team).removesuffix("/**"), member.name
    match member.role:
        case Role.ROUTER:  # what another router passes on, it has judged
            return (f"{root}/**",)
        case Role.ROBOT:
            return f"{root}/agent/{name}/**", f"{root}/live/agent/{name}/*"
        case Role.COORDINATOR:  # it passes on the orders that are given on its page
            return f"{root}/joint/**", f"{root}/live/coordinator/*", f"{root}/operator/**"
        case Role.OPERATOR:  # may deliver a map for a robot, and plays its part meanwhile
            robots = (f"{root}/agent/*/{kind}" for kind in ("map", "mark", "status"))
            found = f"{root}/agent/*/alignment/*/*"
            return f"{root}/operator/{name}/**", *robots, found, f"{root}/live/agent/*/*"
    return ()


def _writing(member: Member) -> list[dict[str, object]]:
    own = own_keys(member)
    if not own:
        return []
    return [
        {
            "id": f"writing-{member.common_name}",
            "messages": list(WRITING),
            "flows": ["ingress"],
            "permission": "allow",
            "key_exprs": [*own, *(f"{key}/{HEALING}" for key in own)],
        }
    ]


def _reading(team: str) -> dict[str, object]:
    return {
        "id": "reading",
        "messages": list(READING),
        "flows": ["ingress"],
        "permission": "allow",
        "key_exprs": _all_of(team),
    }


def _delivering(team: str) -> dict[str, object]:
    return {
        "id": "delivering",
        "messages": [*WRITING, *READING],
        "flows": ["egress"],
        "permission": "allow",
        "key_exprs": _all_of(team),
    }


def _all_of(team: str) -> list[str]:
    return [everything(team), f"{everything(team)}/{HEALING}"]
