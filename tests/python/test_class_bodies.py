# SPDX-License-Identifier: GPL-3.0-or-later
"""The counter of methods and members that test_repository.py judges native/ by."""

from __future__ import annotations

import sys
from pathlib import Path

import pytest

sys.path.insert(0, str(Path(__file__).parent))

from class_bodies import ClassBody, classes  # noqa: E402


def only(source: str) -> ClassBody:
    (found,) = classes(source)
    return found


def counts(body: str) -> tuple[int, int]:
    """Methods and members of a class with that body."""
    found = only("class Body {\n" + body + "\n};")
    return found.methods, found.members


@pytest.mark.parametrize(
    "method",
    [
        "void run();",
        "void run() const { if (a) { b(); } }",
        "Body();",
        "explicit Body(int a) : a_(a), b_{a}, c_() { go(); }",
        "Body() : b_{{1, 2}} {}",
        "~Body();",
        "Body(const Body&) = delete;",
        "bool operator==(const Body&) const = default;",
        "Color<T> operator()(int i) const { return c[i]; }",
        "static std::vector<Face> faces_of(const Mesh& mesh);",
        "template <class X>\n  void add(const X& x) const requires(K == kTaped) { x; }",
        "template <class X> requires std::same_as<X, T> static auto of(X x) -> Y;",
        "virtual double at(int i) const noexcept = 0;",
        "[[nodiscard]] bool good() const;",
        "const std::function<void(int)>& loss() const { return loss_; }",
        "void set(int value = 3, std::vector<int> list = {1, 2});",
    ],
)
def test_a_method_counts_once(method: str) -> None:
    assert counts(method) == (1, 0)


@pytest.mark.parametrize(
    ("member", "count"),
    [
        ("int a;", 1),
        ("int a = 0, b = 1;", 2),
        ("std::map<std::string, int> a, b;", 2),
        ("std::vector<int> a{1, 2}, b;", 2),
        ("std::function<void(int, double)> loss;", 1),
        ("float channel[3][kMaxSlots + kSlotStep];", 1),
        ("alignas(16) float channel[3];", 1),
        ("alignas(16) std::array<float, 3> a = {}, b = {};", 2),
        ("const Scene& scene;", 1),
        ("mutable std::mutex mutex;", 1),
        ("double scale = std::sqrt(2.0);", 1),
        ("decltype(f(x)) value;", 1),
        ("Raw v __attribute__((aligned(32)));", 1),
        ("static constexpr int kMost = 3;", 0),
        ("static inline int count = 0;", 0),
    ],
)
def test_members_count_each_declarator(member: str, count: int) -> None:
    assert counts(member)[1] == count


@pytest.mark.parametrize(
    "neither",
    [
        "using Base::value;",
        "using T = std::function<void(int)>;",
        "friend Body operator+(const Body& a, const Body& b) { return a; }",
        "static_assert(kMost <= 4);",
        "enum class Kind { kOne, kTwo };",
        "struct Proposal;",
        "// int a; void run();",
        "/* int a;\n   int b; */",
        "#define FORBIDDEN int a;",
    ],
)
def test_what_is_neither_does_not_count(neither: str) -> None:
    assert counts(neither) == (0, 0)


def test_texts_do_not_end_a_body() -> None:
    assert counts("const char* a = \"}; int b;\";\nchar c = '{';\nint d = 1'000;") == (0, 3)


def test_nested_classes_count_for_themselves() -> None:
    outer, inner = classes(
        "class Outer {\n public:\n  struct Inner { int a, b; void f(); };\n"
        "  Inner one;\n  void g();\n};"
    )
    assert (outer.name, outer.methods, outer.members) == ("Outer", 1, 1)
    assert (inner.name, inner.methods, inner.members) == ("Inner", 1, 2)


def test_only_definitions_of_classes_are_found() -> None:
    source = """
        class Later;
        enum class Kind { kOne };
        template <class T, class U> void run(T t) { struct Local { int a; }; }
        template <class T>
        class Good : public Base<T>, Other { int a; };
        template <>
        struct Special<true> final { int a; };
        template <class T>
        struct Outer<T>::Inner { int a; };
    """
    assert [found.name for found in classes(source)] == [
        "Local", "Good", "Special<true>", "Outer<T>::Inner",
    ]  # fmt: skip
    assert all(found.members == 1 for found in classes(source))


@pytest.mark.parametrize(
    ("source", "hides"),
    [
        ("struct Value { int a; void f() const; };", False),
        ("struct Value { int a;\n private:\n  using Base = int;\n};", False),
        ("struct Value { int a;\n private:\n  void f();\n};", True),
        ("class Value { int a; };", True),
        ("class Value {\n public:\n  int a;\n};", False),
        ("class Value {\n public:\n  int a;\n protected:\n  int b;\n};", True),
    ],
)
def test_a_class_hides_what_is_not_public(source: str, hides: bool) -> None:
    assert only(source).hides == hides


def test_a_body_that_never_ends_is_an_error() -> None:
    with pytest.raises(ValueError, match="never closed"):
        classes("struct Broken { int a;")
