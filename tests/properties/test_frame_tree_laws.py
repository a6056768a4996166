"""Laws of frame trees: a chain is the product of its joints, whatever the tree; second parents and circles are refused."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from calib_core.errors import InputError
from calib_core.geometry import RigidTransform, rotation_exp
from calib_core.interchange.trees.frame_tree import FrameTree, Joint, Place

PLACE = Place("tree.urdf", 1)
CLOSE = {"rtol": 0, "atol": 1e-9}


@st.composite
def trees(draw: st.DrawFn) -> tuple[FrameTree, dict[str, RigidTransform]]:
    """Return a random tree, and each frame's pose in the root by a separate account."""
    count = draw(st.integers(2, 12))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    root_from = {"f0": RigidTransform.identity()}
    joints = []
    for index in range(1, count):
        parent = f"f{rng.integers(index)}"
        pose = RigidTransform(rotation_exp(rng.normal(size=3)), rng.normal(size=3))
        joints.append(Joint(parent, f"f{index}", pose, PLACE))
        root_from[f"f{index}"] = root_from[parent] @ pose
    return FrameTree(tuple(joints[i] for i in rng.permutation(len(joints)))), root_from


@settings(max_examples=60, deadline=None)
@given(made=trees(), pick=st.tuples(st.integers(0, 99), st.integers(0, 99), st.integers(0, 99)))
def test_any_two_frames_are_chained_by_the_product_of_the_joints_between_them(made, pick):
    tree, root_from = made
    one, two, three = (tree.frames[index % len(tree.frames)] for index in pick)

    expected = root_from[one].inverse() @ root_from[two]
    np.testing.assert_allclose(tree.between(one, two).as_matrix(), expected.as_matrix(), **CLOSE)
    there_and_back = tree.between(one, two) @ tree.between(two, one)
    np.testing.assert_allclose(there_and_back.as_matrix(), np.eye(4), **CLOSE)
    over = tree.between(one, three) @ tree.between(three, two)
    np.testing.assert_allclose(over.as_matrix(), expected.as_matrix(), **CLOSE)
    assert len({id(step.joint) for step in tree.path(one, two)}) == len(tree.path(one, two))
    assert tree.root_of(one) == "f0"


@settings(max_examples=40, deadline=None)
@given(made=trees(), pick=st.tuples(st.integers(0, 99), st.integers(0, 99)))
def test_a_second_parent_and_a_circle_are_refused_and_a_repeated_joint_is_not(made, pick):
    tree, _ = made
    joint = tree.joints[pick[0] % len(tree.joints)]

    assert FrameTree((*tree.joints, joint)).joints == tree.joints
    with pytest.raises(InputError, match="gets a second parent, 'elsewhere'"):
        FrameTree((*tree.joints, Joint("elsewhere", joint.child, RigidTransform.identity(), PLACE)))
    below = (joint.child, *tree.below(joint.child))
    closing = Joint(below[pick[1] % len(below)], "f0", RigidTransform.identity(), PLACE)
    with pytest.raises(InputError, match="form a circle"):
        FrameTree((*tree.joints, closing))
    moved = Joint(joint.parent, joint.child, joint.transform @ RigidTransform(np.eye(3), [0.01, 0, 0]), PLACE)
    with pytest.raises(InputError, match="is given twice, and differs"):
        FrameTree((*tree.joints, moved))


@settings(max_examples=20, deadline=None)
@given(made=trees())
def test_frames_of_two_trees_are_not_connected(made):
    tree, _ = made
    other = Joint("mast", "radar", RigidTransform.identity(), PLACE)

    with pytest.raises(InputError, match="radar and f1 are not connected: one hangs from mast, the other from f0"):
        FrameTree((*tree.joints, other)).between("radar", "f1")
