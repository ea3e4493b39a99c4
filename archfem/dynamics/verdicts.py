"""When a run first meets a mechanism, by each of the definitions in use."""

from archfem.arguments import instance
from archfem.dynamics.history import History
from archfem.errors import InvalidInput
from archfem.joints.criteria import Criteria, flagged
from archfem.limit.counted import Mechanism, counted_mechanisms, demirel_aldemir_mechanism
from archfem.limit.verified import first_verified_mechanism

DEFINITIONS = ("any four joints", "four in a ring", "ring and pier", "verified")
"""Definitions of a mechanism, in the order of tables."""

PUBLISHED = "Demirel and Aldemir"
"""The criterion of `demirel_aldemir_mechanism`, met when "four in a ring" is."""


def first_mechanisms(run: History, criteria: Criteria | None = None) -> dict[str, Mechanism | None]:
    """Find the first mechanism of a run by each definition.

    - "any four joints": four joints of rings and piers, anywhere, hinge or slide at once;
    - "four in a ring": four of one ring do, whatever else fails (local);
    - "ring and pier": four of one ring and one pier do, at least one of each (semi-global);
    - "verified": the failed joints permit a motion of rings or piers, however many they are;
    - "Demirel and Aldemir": as they word it, four of one ring, its class by what piers do.

    Four are as many as the criteria say.

    Args:
        run: which knows its structure.
        criteria: what makes a joint fail; by default the run's own.

    Returns:
        By definition, the mechanism with its time, joints and class, or None.

    Raises:
        InvalidInput: the structure is not known.
    """
    instance(run, History, "run", "give what time_history returns")
    if run.structure is None:
        raise InvalidInput(
            "this history does not know its structure, which a verified mechanism needs: read it "
            "with History.read(path, structure)"
        )
    joints = flagged(run.joints, criteria)
    moved = first_verified_mechanism(run.structure, joints)
    return {
        **counted_mechanisms(joints),
        "verified": None if moved is None else moved.moved,
        PUBLISHED: demirel_aldemir_mechanism(joints),
    }
