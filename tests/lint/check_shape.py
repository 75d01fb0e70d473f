#!/usr/bin/env python3
"""Checks how long functions are and how many members a class has: a class that is too large is several, whatever files it stands in.

usage: check_shape.py [ROOT]      print every violation as file:line: what, exit 1 when there is any
       check_shape.py --list      the longest functions and the largest classes
       check_shape.py --self-test plant one fault of each kind and see it found
"""

import re
import sys
from pathlib import Path

sys.dont_write_bytecode = True

import checker  # noqa: E402

MAX_FUNCTION_LINES = 70  # of code, without comments and blank lines
MAX_MEMBERS = 70  # functions, each overload counted, and values
# Longer ones, that may only get shorter.
LONGER = {
    ("worker/pass/film_writer.cpp", "FilmWriter::write"): 77,
}
FOLDERS = ["common", "worker", "coordinator", "jobs"]

COMMENT_OR_TEXT = re.compile(
    r'R"(?P<mark>[^\s()\\]*)\(.*?\)(?P=mark)"|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/|^[ \t]*#(?:\\\n|[^\n])*',
    re.DOTALL | re.MULTILINE,
)
CLASS = re.compile(r"^(?:template\b.*?>\s*)?(?:class|struct|union)\b(?:\s*\[\[[^\]]*\]\]|\s+alignas\([^)]*\))*\s*([\w:<>, ]*?)(?:\s+final)?\s*(?::[^:].*)?$", re.DOTALL)
ACCESS = re.compile(r"^\s*(?:(?:public|private|protected)\s*:\s*)+")
NO_MEMBER = re.compile(r"^(?:using|friend|typedef|static_assert|static constexpr|enum|BATON_\w+\b)")


def blank(match):
    """What is no code, as spaces; its lines stay."""
    return re.sub(r"[^\n]", " ", match.group()) if match.group()[0] in "/ \t#" else '"' + re.sub(r"[^\n]", " ", match.group()[1:-1]) + '"'


class Block:
    """What stands between two braces."""

    def __init__(self, kind, name, line):
        self.kind = kind  # namespace, class, function or other
        self.name = name
        self.line = line  # of the beginning of its statement
        self.functions = 0
        self.values = 0


def top_level(text, separator):
    """Splits at a separator that stands in no brackets."""
    parts, depth = [""], 0
    for sign in text:
        depth += (sign in "([{<") - (sign in ")]}>")
        if sign == separator and depth <= 0:
            parts.append("")
        else:
            parts[-1] += sign
    return parts


def kind_of(head, parent):
    """The kind and name of the block that begins after this text."""
    if re.match(r"^(?:inline\s+)?namespace\b|^extern\b", head):
        return "namespace", ""
    match = CLASS.match(head)
    if match and "(" not in re.sub(r"alignas\([^)]*\)|\[\[.*?\]\]", "", head.split(":")[0]):
        return "class", match.group(1).strip() or "(no name)"
    if parent.kind in ("namespace", "class") and re.search(r"\)", head) and not re.match(r"^enum\b", head):
        before = re.split(r"\(", head, 1)[0]
        if "=" not in before or "operator" in before:
            return "function", (before.split() or [""])[-1]
    return "other", ""


def count_member(statement, block):
    """Adds what a statement of a class declares."""
    text = ACCESS.sub("", statement.strip())
    if not text or NO_MEMBER.match(text):
        return
    text = re.sub(r"^template\s*<.*?>\s*(?:requires\b.*?\)\s*)?", "", text, flags=re.DOTALL)
    is_function = "(" in re.split(r"=(?!=)|\{", text.replace("operator=", "operator"), 1)[0]
    if is_function and not re.search(r"std::function<|alignas\(", re.split(r"=", text, 1)[0]):
        if "= delete" not in text and "= default" not in text:
            block.functions += 1
    else:
        block.values += len(top_level(text, ","))


def shapes_of(text):
    """Yields ('function', name, line, lines) and ('class', name, line, (functions, values)) of a source."""
    text = COMMENT_OR_TEXT.sub(blank, text)
    source_lines = text.splitlines()
    stack, begin, line = [Block("namespace", "", 1)], 0, 1
    parens = 0
    for place, sign in enumerate(text):
        if sign == "\n":
            line += 1
        parens += (sign == "(") - (sign == ")")
        if parens > 0 and stack[-1].kind in ("namespace", "class"):
            continue
        if sign == "{":
            raw = text[begin:place]
            head = ACCESS.sub("", raw.strip())
            # `x_{1}` sets a value; what has a body stands off.
            kind, name = kind_of(head, stack[-1]) if text[place - 1].isspace() else ("other", "")
            first = line - raw.lstrip().count("\n")
            stack.append(Block(kind, name, first))
            stack[-1].head = begin
            if kind in ("namespace", "class", "function"):
                begin = place + 1
        elif sign == "}":
            block = stack.pop() if len(stack) > 1 else stack[-1]
            if block.kind == "function":
                code = source_lines[block.line - 1 : line]
                yield "function", block.name, block.line, sum(1 for text_line in code if text_line.strip())
                if stack[-1].kind == "class":
                    count_member(text[block.head : place + 1], stack[-1])
                begin = place + 1
            elif block.kind == "class":
                yield "class", block.name, block.line, (block.functions, block.values)
                begin = place + 1
            elif block.kind == "namespace":
                begin = place + 1
        elif sign == ";" and stack[-1].kind in ("namespace", "class"):
            if stack[-1].kind == "class":
                count_member(text[begin:place], stack[-1])
            begin = place + 1
        elif sign == ":" and stack[-1].kind == "class" and re.match(r"^\s*(?:public|private|protected)\s*$", text[begin:place]):
            begin = place + 1


def all_shapes(root):
    """The shapes of every source of the product: (file, kind, name, line, size)."""
    for folder in FOLDERS:
        for file in sorted((root / folder).rglob("*")):
            if file.suffix in (".h", ".cpp"):
                path = file.relative_to(root).as_posix()
                for shape in shapes_of(file.read_text(encoding="utf-8")):
                    yield (path, *shape)


def fault_of(path, kind, name, size):
    """Why a shape is too large; None: it is not."""
    most = LONGER.get((path, name), MAX_FUNCTION_LINES)
    if kind == "function" and size > most:
        return f"function {name} has {size} lines of code, at most {most}"
    if kind == "class" and sum(size) > MAX_MEMBERS:
        return f"class {name} has {sum(size)} members ({size[0]} functions, {size[1]} values), at most {MAX_MEMBERS}"
    return None


def self_test():
    """Plants each fault in a text of its own. Returns the number of texts that were judged wrongly."""
    def body(lines):
        return "  call();\n" * lines
    members = "".join(f"  void f{i}(int a = 0, const B& b = {{}}) const;\n" for i in range(MAX_MEMBERS - 40))
    members += "".join(f"  std::map<int, int> v{i}_, w{i}_ = {{}};\n" for i in range(20))
    cases = [
        ("void f() {\n" + body(MAX_FUNCTION_LINES - 2) + "}\n", 0),
        ("Status A::f(int x,\n            int y) const {\n" + body(MAX_FUNCTION_LINES - 2) + "}\n", 1),
        ("class A {\n public:\n  explicit A(int x) : x_(x), y_{1} {\n" + body(MAX_FUNCTION_LINES) + "  }\n  int x_;\n};\n", 1),
        ("template <class M>\nM f() {\n  const auto g = [&] {\n" + body(MAX_FUNCTION_LINES) + "  };\n}\n", 1),
        ("void f() {\n" + body(MAX_FUNCTION_LINES - 2) + "  // why\n\n" * 9 + "}\n", 0),
        ("constexpr A kTable[] = {\n" + "  {1, 2},\n" * 200 + "};\n", 0),
        ("struct A {\n" + members + "};\n", 0),
        ("class A final : public B {\n public:\n" + members + " private:\n  int one_more_;\n};\n", 1),
        ("class A {\n" + members + "  struct Part {\n    int a, b, c;\n  };\n  using B = C<1, 2>;\n  A(const A&) = delete;\n};\n", 0),
        ("class A {\n" + members + "  int f() const { return 1; }\n};\n", 1),
    ]
    wrong = 0
    for number, (text, expected) in enumerate(cases):
        found = [fault for kind, name, _, size in shapes_of(text) if (fault := fault_of("", kind, name, size))]
        if len(found) != expected:
            wrong += 1
            print(f"self-test {number}: expected {expected} faults, got {found}: {list(shapes_of(text))}")
    print(f"self-test: {len(cases) - wrong} of {len(cases)} as expected")
    return wrong


def print_list(root):
    """The longest functions and the largest classes."""
    shapes = list(all_shapes(root))
    for kind, measure in (("function", int), ("class", sum)):
        largest = sorted((s for s in shapes if s[1] == kind), key=lambda s: -measure(s[4]))[:25]
        print("\n".join(f"{path}:{line}: {kind} {name}: {size}" for path, _, name, line, size in largest))


def faults(root):
    return [f"{path}:{line}: {fault}" for path, kind, name, line, size in all_shapes(root) if (fault := fault_of(path, kind, name, size))]


if __name__ == "__main__":
    if sys.argv[1:] == ["--list"]:
        print_list(Path(__file__).resolve().parents[2])
        sys.exit(0)
    sys.exit(checker.run(__doc__, self_test, faults))
