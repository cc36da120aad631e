import pytest

from service.schemas.merge_patch import apply_merge_patch


@pytest.mark.parametrize(
    ("target", "patch", "result"),
    [
        # RFC 7396, appendix A.
        ({"a": "b"}, {"a": "c"}, {"a": "c"}),
        ({"a": "b"}, {"b": "c"}, {"a": "b", "b": "c"}),
        ({"a": "b"}, {"a": None}, {}),
        ({"a": "b", "b": "c"}, {"a": None}, {"b": "c"}),
        ({"a": ["b"]}, {"a": "c"}, {"a": "c"}),
        ({"a": "c"}, {"a": ["b"]}, {"a": ["b"]}),
        ({"a": {"b": "c"}}, {"a": {"b": "d", "c": None}}, {"a": {"b": "d"}}),
        ({"a": [{"b": "c"}]}, {"a": [1]}, {"a": [1]}),
        (["a", "b"], ["c", "d"], ["c", "d"]),
        ({"a": "b"}, ["c"], ["c"]),
        ({"a": "foo"}, None, None),
        ({"e": None}, {"a": 1}, {"e": None, "a": 1}),
        ([1, 2], {"a": "b", "c": None}, {"a": "b"}),
        ({}, {"a": {"bb": {"ccc": None}}}, {"a": {"bb": {}}}),
    ],
)
def test_patches_do_what_the_rfc_says(target, patch, result):
    assert apply_merge_patch(target, patch) == result


def test_what_has_ids_may_be_patched_by_them():
    cameras = [{"id": "left", "source": None}, {"id": "right", "source": None}]
    patch = {"right": {"source": "x"}, "left": None, "third": {"source": "y"}}
    assert apply_merge_patch(cameras, patch) == [{"id": "right", "source": "x"}, {"id": "third", "source": "y"}]
    assert cameras[1]["source"] is None


def test_a_patch_without_a_bottom_breaks_nothing():
    deep = {}
    for _ in range(5000):
        deep = {"a": deep}
    assert apply_merge_patch({}, deep)["a"]
