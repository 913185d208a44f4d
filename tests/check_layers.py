#!/usr/bin/env python3
"""Enforces the layers: check_layers.py [--root DIR]. --self-test tests this program; --picture prints which layer
includes which, as in docs/architecture.md.

A layer may include headers of itself and of the layers before it. The tables below say which files may use other
libraries (DDS, YAML ...), threads and the clock. Tests and benchmarks are exempt.
"""

import argparse
import pathlib
import re
import sys
import tempfile
import unittest

LAYERS = ["base", "math", "types", "tree", "partition", "calls", "description", "store", "keys", "recording",
          "transport", "memory", "runtime", "client", "apps", "python"]
# Use the library as everybody does, and know nothing of each other.
USERS = ["apps", "python"]
# A header whose name its users expect there.
ABOVE_LAYERS = {"include/tfdude/tf2.hpp": "client"}
SUFFIXES = {".hpp", ".cpp", ".h", ".cc", ".ipp"}
DDS_FOLDER = "src/transport/fastdds/"
# Has another participant, in a domain of ROS. It shares the differences between versions, the checks of
# datagrams, and the reader of CDR.
ROS_DDS_FOLDER = "apps/tfdude-ros/fastdds/"
DDS_FOLDERS = (DDS_FOLDER, ROS_DDS_FOLDER)
# What a program may include of the library's private parts. Its own build compiles what it needs of them.
SHARED = {
    ROS_DDS_FOLDER: (
        "src/transport/fastdds/compat.hpp", "src/base/cdr.hpp", "src/transport/fastdds/datagram_guard.hpp",
        "src/transport/fastdds/farewells.hpp", "src/transport/fastdds/send_filter.hpp"),
    "apps/tfdude-ros/config/": ("src/description/file_text.hpp", "src/description/yaml_fields.hpp"),
    "apps/tfdude-ros/logic/": ("src/types/ros_rules.hpp",),
    "apps/tfdude-web/foxglove_messages.cpp": ("src/types/ros_tf.hpp",),
}

# (what, pattern of the include, folders or files that may include it)
CONFINED = [
    ("Boost", r"boost/(?!math/)", ["src/tree/graph.hpp", "apps/tfdude-web/server.cpp"]),
    ("Boost.Math", r"boost/math/", ["src/math/fusion.cpp"]),
    ("DDS", r"(fastdds|fastrtps|fastcdr)/", list(DDS_FOLDERS)),
    ("yaml-cpp", r"yaml-cpp/", ["src/description/", "apps/tfdude-ros/config/"]),
    ("urdfdom", r"(urdf_(model|parser|exception)|console_bridge)/", ["src/description/"]),
    ("tinyxml2", r"tinyxml2\.h$", ["src/description/", "src/keys/", "src/transport/fastdds/",
                                   "apps/tfdude-web/meshes.cpp"]),
    ("SQLite", r"sqlite3\.h$", ["src/store/"]),
    ("OpenSSL", r"openssl/", ["src/keys/"]),
    ("zstd", r"zstd\.h$", ["src/recording/"]),
    ("GeographicLib", r"GeographicLib/", ["src/math/earth.cpp"]),
    ("zlib", r"zlib\.h$", ["src/recording/"]),
    ("CLI11", r"CLI/", ["apps/"]),
    ("nlohmann", r"nlohmann/", ["apps/"]),
    ("pybind11", r"(pybind11/|Python\.h$)", ["python/"]),
]
# (what, pattern of the include, layers that must do without it)
BARRED = [
    ("threads", r"(thread|future|condition_variable)$", ["math", "types", "tree", "partition", "calls"]),
    ("locks and atomics", r"(mutex|shared_mutex|atomic)$", ["math", "types", "partition", "calls"]),
    ("input and output", r"(iostream|fstream|spdlog/.*)$", ["math", "types", "tree", "partition", "calls"]),
]
CLOCK = re.compile(r"::\s*now\s*\(|\b(clock_gettime|gettimeofday)\b|\btime\s*\(\s*(nullptr|NULL|0)\s*\)")
CLOCKLESS = ["base", "math", "types", "tree", "partition", "calls", "description", "store", "keys",
             "recording"]

# Runs jobs at the times that they name.
CLOCK_FREE = ["src/base/loop.cpp"]

# Numbers are written by tfdude/base/number.hpp, and read by std::from_chars(). Streams and these functions follow the
# locale of the program. Our own programs never set one.
LOCALE_SET = re.compile(r"\bsetlocale\b|\blocale::global\b")
LOCALE_WORDS = re.compile(LOCALE_SET.pattern + r"|\b(i|o)?stringstream\b|\b(sto(d|f|ld)|strto(d|f|ld)|atof)\b")
LOCALE_FORMAT = re.compile(r'"(?:\\.|[^"\\\n])*%[-+#0]*[0-9*]*(\.[0-9*]+)?l?[aefgAEFG](?:\\.|[^"\\\n])*"')
# Read words, or in the locale of C.
LOCALE_FREE = ["src/description/yaml_quirks.cpp", "src/keys/authority.cpp", "src/transport/fastdds/announcement.cpp"]

# Each program has a folder in apps, and uses no other's. They share the files in apps itself, and rendering, which uses
# none of them. A command of the command line uses no other command.
SHARED_RENDERING = "apps/rendering"
COMMAND = "apps/tfdude/commands/"

INCLUDE = re.compile(r'^\s*#\s*include\s*[<"]([^>"]+)[>"]', re.MULTILINE)
COMMENT_OR_LITERAL = re.compile(
    r'//[^\n]*|/\*.*?\*/|R"([^(\s]*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"', re.DOTALL)


def strip_comments(text, literals_too=False):
    """Replaces comments (and literals) by blanks; line numbers stay the same."""
    def blank(match):
        comment = match.group().startswith("/")
        return re.sub(r"[^\n]", " ", match.group()) if comment or literals_too else match.group()
    return COMMENT_OR_LITERAL.sub(blank, text)


def layer_of(path):
    """The layer of a file of the project; None if it belongs to no layer."""
    if path in ABOVE_LAYERS:
        return ABOVE_LAYERS[path]
    match = re.match(r"(?:include/tfdude|src)/([^/]+)/|(apps|python)/", path)
    name = match and (match[1] or match[2])
    return name if name in LAYERS else None


def room_of(path):
    """The folder of a program, or that of rendering; None for other files."""
    match = re.match(r"(apps/[^/]+)/", path)
    return match and match[1]


class Checker:
    def __init__(self, root):
        self.root = pathlib.Path(root)
        self.files = {
            path.relative_to(self.root).as_posix(): path.read_text(encoding="utf-8")
            for folder in ("include", "src", "apps", "python")
            for path in sorted((self.root / folder).rglob("*"))
            if path.suffix in SUFFIXES and path.is_file()}
        self.generated = {
            idl.stem + tail
            for idl in (self.root / "idl").glob("*.idl")
            for part in ("", "PubSubTypes", "CdrAux", "TypeObjectSupport", "_types")
            for tail in (part + ".h", part + ".hpp", part + ".ipp")}
        self.findings = []
        self.arrows = set()  # (layer, layer that it includes)

    def report(self, path, position, rule, message):
        line = self.files[path].count("\n", 0, position) + 1 if position is not None else 1
        self.findings.append((rule, f"{path}:{line}: [{rule}] {message}"))

    def resolve(self, path, name):
        """The project's file that an include names, found as by the compiler; or None."""
        here = path.rsplit("/", 1)[0]
        for folder in (here, "include", "src"):
            parts = []
            for part in f"{folder}/{name}".split("/"):
                if part == ".." and parts:
                    parts.pop()
                elif part != ".":
                    parts.append(part)
            if "/".join(parts) in self.files:
                return "/".join(parts)
        return None

    def check_include(self, path, layer, position, name):
        target = self.resolve(path, name)
        if target is None and name.startswith("tfdude/"):
            target = "include/" + name  # a header that does not exist (yet) still has a layer
        if target is not None:
            self.check_own(path, layer, position, name, target)
            return
        if name.rsplit("/", 1)[-1] in self.generated and not path.startswith(DDS_FOLDERS):
            self.report(path, position, "confined", f"<{name}> is generated: only in {', '.join(DDS_FOLDERS)}")
        for what, pattern, places in CONFINED:
            if re.match(pattern, name) and not any(path.startswith(place) for place in places):
                self.report(path, position, "confined", f"<{name}>: {what} only in {', '.join(places)}")
        for what, pattern, layers in BARRED:
            if re.match(pattern, name) and layer in layers:
                self.report(path, position, "barred", f"<{name}>: {layer} does without {what}")
        standard = "/" not in name and "." not in name
        if layer == "math" and not standard and not name.startswith(("Eigen/", "boost/math/", "GeographicLib/")):
            self.report(path, position, "math",
                        f"<{name}>: math knows only Eigen, Boost.Math, GeographicLib, base and std")

    def check_own(self, path, layer, position, name, target):
        other = layer_of(target)
        if other not in (None, layer):
            self.arrows.add((layer, other))
        if other is None or LAYERS.index(other) > LAYERS.index(layer) or {layer, other} == set(USERS):
            self.report(path, position, "arrow", f'{layer} may not include "{name}" of {other}')
        if path.startswith("include/") and not target.startswith("include/"):
            self.report(path, position, "public", f'a public header includes the private "{name}"')
        here, there = room_of(path), room_of(target)
        if here and there and here != there and there != SHARED_RENDERING:
            self.report(path, position, "room", f'{here} may not include "{name}" of {there}')
        command = re.match(COMMAND + r"(\w+)\.", path)
        if command and re.match(COMMAND, target) and not re.match(COMMAND + command[1] + r"\.", target):
            self.report(path, position, "room", f'a command may not include "{name}" of another one')
        shares = any(path.startswith(place) and target in shared for place, shared in SHARED.items())
        if layer in USERS and target.startswith("src/") and not target.startswith(DDS_FOLDER) and not shares:
            self.report(path, position, "public", f'a program includes the private "{name}"')
        if target.startswith(DDS_FOLDER) and not path.startswith(DDS_FOLDER) and not shares:
            self.report(path, position, "confined", f'"{name}" may bring DDS along: only in {DDS_FOLDER}')

    def check_locale(self, path, layer, text):
        """Numbers in messages, files and texts are the same in each locale."""
        found = [(LOCALE_SET if layer == "apps" else LOCALE_WORDS, strip_comments(text, literals_too=True))]
        if layer != "apps":
            found.append((LOCALE_FORMAT, strip_comments(text)))
        for pattern, code in found if path not in LOCALE_FREE else []:
            for match in pattern.finditer(code):
                self.report(path, match.start(), "locale", "depends on the locale: use tfdude/base/number.hpp")

    def check_listed(self):
        """Each public header is in the file set: installed, and compiled alone by the dev preset."""
        listing = self.root / "src/CMakeLists.txt"
        listed = listing.read_text(encoding="utf-8") if listing.exists() else ""
        for path in self.files:
            if path.startswith("include/") and path.removeprefix("include/") not in listed:
                self.report(path, None, "listed", "is not in the header list of src/CMakeLists.txt")

    def picture(self):
        """A Mermaid diagram of which layer includes which, without arrows that follow from others."""
        def reaches(start, end):
            return any(other == end or reaches(other, end)
                       for layer, other in self.arrows if layer == start)
        shown = [(layer, other) for layer, other in sorted(self.arrows)
                 if not any(reaches(between, other) for start, between in self.arrows
                            if start == layer and between != other)]
        return "".join(["```mermaid\n", "graph TD\n", *(f"  {a} --> {b}\n" for a, b in shown), "```\n"])

    def check_picture(self):
        page = self.root / "docs/architecture.md"
        if page.exists() and self.picture() not in page.read_text(encoding="utf-8"):
            self.findings.append(("picture", "docs/architecture.md: [picture] is not what --picture prints"))

    def run(self):
        for path, text in self.files.items():
            layer = layer_of(path)
            if layer is None:
                self.report(path, None, "place", "lies in no layer's folder")
                continue
            for match in INCLUDE.finditer(strip_comments(text)):
                self.check_include(path, layer, match.start(1), match.group(1))
            if layer in CLOCKLESS and str(path) not in CLOCK_FREE:
                for match in CLOCK.finditer(strip_comments(text, literals_too=True)):
                    self.report(path, match.start(), "clock", f"{layer} is handed the time, it reads no clock")
            self.check_locale(path, layer, text)
        self.check_listed()
        if not any(rule == "arrow" for rule, _ in self.findings):
            self.check_picture()
        return self.findings


class SelfTest(unittest.TestCase):
    """Every rule finds its violation, and nothing in a clean tree."""

    CLEAN = {
        "idl/wire.idl": "",
        "src/CMakeLists.txt": "tfdude/base/id.hpp tfdude/math/pose.hpp tfdude/tree/forest.hpp",
        "include/tfdude/base/id.hpp": "#include <string>\n#include <tl/expected.hpp>\n",
        "include/tfdude/math/pose.hpp": '#include <Eigen/Core>\n#include "tfdude/base/id.hpp"\n',
        "include/tfdude/tree/forest.hpp": '#include <mutex>\n#include "tfdude/math/pose.hpp"\n',
        "src/tree/graph.hpp": "#include <boost/graph/adjacency_list.hpp>\n",
        "src/tree/forest.cpp": '#include "graph.hpp"\n#include "tree/graph.hpp"\n#include <atomic>\n',
        "src/math/pose.cpp": '// ::now() and #include <thread>\n/*\n#include <mutex>\n*/\nauto s = "x::now()";\n',
        "src/transport/fastdds/wire.cpp": '#include <fastdds/dds/core.hpp>\n#include "wire.h"\n',
        "src/transport/fastdds/entity.hpp": "#include <fastdds/dds/core.hpp>\n",
        "src/description/config.cpp": "#include <yaml-cpp/yaml.h>\n",
        "src/runtime/loop.cpp": 'auto t = Clock::now();\n#include <thread>\nlog("50 % of 3", "%04o");\n',
        "apps/tfdude/main.cpp": '#include <CLI/CLI.hpp>\n#include <nlohmann/json.hpp>\n#include "tool.hpp"\n',
        "apps/tfdude/commands/tree.hpp": '#include "../../rendering/text.hpp"\n#include "../../worker.hpp"\n',
        "apps/tfdude/commands/tree.cpp": '#include "tree.hpp"\n#include "../tool.hpp"\n',
        "apps/rendering/text.hpp": "#include <string>\n",
        "apps/worker.hpp": "#include <thread>\n",
        "python/src/module.cpp": '#include <pybind11/pybind11.h>\n#include "tfdude/tree/forest.hpp"\n',
        "apps/tfdude/tool.hpp": '#include "tfdude/tree/forest.hpp"\n',
        "src/transport/fastdds/compat.hpp": "#include <fastdds/dds/core.hpp>\n",
        "apps/tfdude-ros/fastdds/ros.cpp":
            '#include <fastdds/dds/core.hpp>\n#include "transport/fastdds/compat.hpp"\n#include <wire_types.hpp>\n',
    }
    # (rule, file, text)
    VIOLATIONS = [
        ("arrow", "src/base/a.cpp", '#include "tfdude/math/pose.hpp"\n'),
        ("arrow", "src/math/a.cpp", '#include "tree/graph.hpp"\n'),
        ("arrow", "src/math/a.cpp", '#include "../tree/graph.hpp"\n'),
        ("arrow", "src/tree/a.cpp", "#include <tfdude/partition/not_there.hpp>\n"),
        ("arrow", "src/partition/a.cpp", '#  include "tfdude/transport/port.hpp"\n'),
        ("arrow", "src/transport/a.cpp", '#include "tfdude/client/client.hpp"\n'),
        ("arrow", "src/runtime/a.cpp", '#include "tfdude/client/client.hpp"\n'),
        ("arrow", "src/types/a.cpp", '#include "tree/graph.hpp"\n'),
        ("arrow", "src/client/a.cpp", '#include "../../apps/tfdude/tool.hpp"\n'),
        ("arrow", "src/client/a.cpp", '#include "tfdude/unheard_of/a.hpp"\n'),
        ("public", "apps/tfdude/a.cpp", '#include "tree/graph.hpp"\n'),
        ("arrow", "python/src/a.cpp", '#include "../../apps/tfdude/tool.hpp"\n'),
        ("public", "python/src/a.cpp", '#include "tree/graph.hpp"\n'),
        ("public", "include/tfdude/tree/forest.hpp", '#include "tree/graph.hpp"\n'),
        ("confined", "src/tree/a.cpp", "#include <boost/graph/graph_traits.hpp>\n"),
        ("confined", "src/client/a.cpp", "#include <fastdds/dds/core.hpp>\n"),
        ("confined", "src/transport/loopback/a.cpp", "#include <fastrtps/types.h>\n"),
        ("confined", "src/transport/a.cpp", "#include <fastcdr/Cdr.h>\n"),
        ("confined", "src/client/a.cpp", '#include "wirePubSubTypes.h"\n'),
        ("confined", "src/client/a.cpp", "#include <generated/wire.hpp>\n"),
        ("confined", "apps/tfdude/a.cpp", '#include "transport/fastdds/entity.hpp"\n'),
        ("confined", "apps/tfdude-ros/fastdds/a.cpp", '#include "transport/fastdds/entity.hpp"\n'),
        ("confined", "apps/tfdude-ros/a.cpp", "#include <fastdds/dds/core.hpp>\n"),
        ("confined", "apps/tfdude-ros/a.cpp", "#include <wire_types.hpp>\n"),
        ("confined", "apps/tfdude-ros/a.cpp", '#include "transport/fastdds/compat.hpp"\n'),
        ("confined", "apps/tfdude/a.cpp", "#include <yaml-cpp/yaml.h>\n"),
        ("confined", "src/client/a.cpp", "#include <yaml-cpp/yaml.h>\n"),
        ("confined", "src/client/a.cpp", "#include <CLI/CLI.hpp>\n"),
        ("confined", "apps/tfdude/a.cpp", "#include <urdf_parser/urdf_parser.h>\n"),
        ("confined", "src/store/a.cpp", "#include <tinyxml2.h>\n"),
        ("confined", "src/client/a.cpp", "#include <sqlite3.h>\n"),
        ("confined", "src/transport/a.cpp", "#include <openssl/x509.h>\n"),
        ("arrow", "src/store/a.cpp", '#include "tfdude/transport/port.hpp"\n'),
        ("confined", "src/client/a.cpp", "#include <nlohmann/json.hpp>\n"),
        ("confined", "src/client/a.cpp", "#include <pybind11/numpy.h>\n"),
        ("room", "apps/tfdude-web/a.cpp", '#include "../tfdude/tool.hpp"\n'),
        ("room", "apps/rendering/a.cpp", '#include "../tfdude/tool.hpp"\n'),
        ("room", "apps/tfdude/commands/frames.cpp", '#include "tree.hpp"\n'),
        ("math", "src/math/a.cpp", "#include <tl/expected.hpp>\n"),
        ("math", "src/math/a.cpp", "#include <unistd.h>\n"),
        ("barred", "src/partition/a.cpp", "int a;  // fine\n#include <thread>\n"),
        ("barred", "src/math/a.cpp", "#include <mutex>\n"),
        ("barred", "src/partition/a.cpp", "#include <atomic>\n"),
        ("barred", "src/tree/a.cpp", "#include <thread>\n"),
        ("barred", "src/partition/a.cpp", "#include <spdlog/spdlog.h>\n"),
        ("clock", "src/partition/a.cpp", "auto t = std::chrono::system_clock::now();\n"),
        ("clock", "src/tree/a.cpp", "auto t = Clock::now ();\n"),
        ("clock", "src/math/a.cpp", "auto t = std::time(nullptr);\n"),
        ("locale", "src/runtime/a.cpp", "std::ostringstream text;\n"),
        ("locale", "python/src/a.cpp", "double x = std::strtod(text, nullptr);\n"),
        ("locale", "src/math/a.cpp", 'std::snprintf(text, 32, "at %8.3f m", x);\n'),
        ("locale", "apps/tfdude/a.cpp", 'std::setlocale(LC_ALL, "");\n'),
        ("place", "src/a.cpp", "int a;\n"),
        ("place", "src/unheard_of/a.cpp", "int a;\n"),
        ("listed", "include/tfdude/tree/unlisted.hpp", "\n"),
        ("picture", "docs/architecture.md", "```mermaid\ngraph TD\n  tree --> base\n```\n"),
    ]

    def findings(self, changes):
        with tempfile.TemporaryDirectory() as root:
            for path, text in {**self.CLEAN, **changes}.items():
                file = pathlib.Path(root, path).resolve()
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
            return Checker(root).run()

    def test_clean_tree_has_no_findings(self):
        self.assertEqual(self.findings({}), [])

    def test_each_violation_is_found(self):
        for rule, path, text in self.VIOLATIONS:
            with self.subTest(path=path, text=text):
                rules = {found for found, _ in self.findings({path: text})}
                self.assertIn(rule, rules)
                self.assertLessEqual(rules, {rule, "listed"})

    def test_line_is_named(self):
        self.assertIn(":2: ", self.findings({"src/base/a.cpp": '\n#include "tfdude/math/pose.hpp"\n'})[0][1])


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--root", default=pathlib.Path(__file__).resolve().parent.parent)
    parser.add_argument("--self-test", action="store_true")
    parser.add_argument("--picture", action="store_true")
    arguments = parser.parse_args()
    if arguments.self_test:
        unittest.main(argv=[sys.argv[0]])
    checker = Checker(arguments.root)
    findings = checker.run()
    if arguments.picture:
        print(checker.picture(), end="")
        return
    for _, message in findings:
        print(message)
    if not checker.files:
        sys.exit(f"check_layers: no sources under {arguments.root}")
    sys.exit(f"{len(findings)} violations" if findings else 0)


if __name__ == "__main__":
    main()
