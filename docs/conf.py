"""The documentation site: ``make docs``. Strict, and offline: formulas, search and pictures need no
other server."""

from __future__ import annotations

import functools
import importlib
import importlib.util
import inspect
import os
import pkgutil
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

from docutils import nodes
from docutils.utils.math import MathError, latex2mathml
from sphinx import addnodes
from sphinx.application import Sphinx
from sphinx.environment import BuildEnvironment
from sphinx.util import logging

from compare.commands import options, parsers
from compare.figures.pages import typeset

HERE = Path(__file__).parent
PACKAGES = ("model", "analytic", "mjsim", "compare")
INNER = ("commands", "report", "view")
"""Rooms of `compare` that are the program itself, which nobody calls: its help tells of them."""
log = logging.getLogger(__name__)

project = "dualball"
author = "The dualball developers"
version = release = tomllib.loads((HERE.parent / "pyproject.toml").read_text("utf-8"))["project"][
    "version"
]

extensions = [
    *("myst_nb", "sphinx.ext.autodoc", "sphinx.ext.mathjax"),
    *("sphinx-mathjax-offline", "sphinx_copybutton"),
]
copybutton_prompt_text = "$ "
exclude_patterns = ["_build", "conf.py", "studies"]
html_theme = "furo"
html_title = f"dualball {version}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_copyright = False
mathjax3_config = {"chtml": {"scale": 0.93}}

# Notebooks are scripts with cells, and are run for every build.
nb_custom_formats = {".py": ["jupytext.reads", {"fmt": "py:percent"}]}
nb_execution_mode = "force"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_execution_timeout = 600  # a machine may be busy
nb_merge_streams = True
nb_render_markdown_format = "myst"
os.environ |= {"COLUMNS": "100", "NO_COLOR": "1", "TERM": "dumb"}
# for !dualball
os.environ["PATH"] = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
myst_enable_extensions = ["dollarmath", "attrs_inline"]
myst_heading_anchors = 3

default_role = "code"
highlight_language = "text"
autodoc_type_aliases = {"npt.ArrayLike": "ArrayLike", "Array": "Array"}
suppress_warnings = ["ref.python"]  # two classes of one name in an annotation: neither is linked
autodoc_member_order = "bysource"
# a page lists its modules; with all they have a build takes half as long again
toc_object_entries = False
autodoc_mock_imports = [
    "dartpy",
    "mujoco_warp",
    "newton",
    "pybullet",
    "pydrake",
    "rapier3d",
    "sapien",
    "warp",
]  # extras
autodoc_default_options = {"members": True, "show-inheritance": True}


def reference(app: Sphinx) -> None:
    """A page a package, with all of its modules; `compare` has one for each of its rooms; and the
    command line."""
    shutil.rmtree(HERE / "api", ignore_errors=True)
    (HERE / "api").mkdir()
    for name in PACKAGES:
        page(importlib.import_module(name))
    (HERE / "api" / "commands.md").write_text(commands(), "utf-8")


def commands() -> str:
    """All commands as their parsers explain them, by group."""
    known: options.Commands = options.Parser(prog="dualball").add_subparsers(prog="dualball")
    lines = ["# Command line", "", "As `dualball COMMAND --help` prints it.", ""]
    for group, own in parsers.GROUPS.items():
        lines += [f"## {group.capitalize()}", ""]
        for name in own:
            parsers.declare(known, name)
            helped = known.choices[name].format_help().strip()
            lines += [f"### {name}", "", "```text", helped, "```", ""]
    return "\n".join(lines)


def site(app: Sphinx, error: Exception | None) -> None:
    """Put a motion in 3-D and a report beside the pages, which the home page leads to.

    The report is that of `make validate`, if there is one. Else the three engines are asked for
    steady motions of one parameter set, which takes half a minute."""
    if error or app.builder.name != "html":
        return
    out = Path(app.outdir)
    run = [sys.executable, "-m", "compare"]

    def dualball(*words: object) -> None:
        subprocess.run([*run, *map(str, words)], check=True, cwd=out, capture_output=True)

    dualball("simulate", "--omega-0", 25, "--time", 6, "-o", "run.h5")
    dualball("render", "run.h5", "-o", "run.html")
    made = HERE.parent / "results" / "report.html"
    if not made.exists():
        few = ["--claim", "prop-4", "--set", "reference"]
        made = out / "report" / "report.html"
        subprocess.run(
            [*run, "validate", "--quick", *few, "-o", str(made.parent)],
            cwd=out,
            capture_output=True,
        )  # which ends with 1 where a claim isn't confirmed
    shutil.copy(made, out / "report.html")


def page(package: ModuleType) -> None:
    """Write the page of a package, and those of the packages in it."""
    title = package.__name__
    lines = [title, "=" * len(title), "", f".. automodule:: {title}", "   :no-members:"]
    for each in (getattr(package, name) for name in getattr(package, "__all__", ())):
        paragraph = inspect.getdoc(each).partition("\n\n")[0]
        summary = literal_bars(paragraph.replace("\n", " "))
        lines += ["", f"* :py:obj:`~{each.__module__}.{each.__qualname__}`: {summary}"]
    modules = [
        each for each in pkgutil.iter_modules(package.__path__) if not each.name.startswith("_")
    ]
    for module in modules:
        if not module.ispkg:
            name = f"{package.__name__}.{module.name}"
            lines += ["", name, "-" * len(name), "", f".. automodule:: {name}"]
    rooms = [
        importlib.import_module(f"{package.__name__}.{each.name}") for each in modules if each.ispkg
    ]
    rooms = [
        room
        for room in rooms
        if any(pkgutil.iter_modules(room.__path__)) and room.__name__.split(".")[1] not in INNER
    ]
    if rooms:
        lines += ["", ".. toctree::", "   :hidden:", "", *(f"   {room.__name__}" for room in rooms)]
    (HERE / "api" / f"{package.__name__}.rst").write_text("\n".join(lines) + "\n", "utf-8")
    for room in rooms:
        page(room)


def source_links(app: Sphinx, where: object, *source: list[str]) -> None:
    """Links to modules, which a repository shows as files, lead to the reference; those to tests
    are only names."""
    text = source[-1]  # of a page, or of what a page includes
    # tables written by `dualball attractors --page`, to which a page links
    if str(where).startswith("records/attractors/"):
        text[0] = f"---\norphan: true\n---\n\n{text[0]}"

    def to_reference(link: re.Match[str]) -> str:
        name = link[2].removesuffix(".py").removesuffix("/__init__").strip("/").replace("/", ".")
        if importlib.util.find_spec(name) is None:
            log.warning("there is no module %s", name, location=str(where))
        return f"{{py:mod}}`{link[1].strip('`')} <{name}>`"

    text[0] = re.sub(
        rf"\[([^\]]+)\]\((?:\.\./)*((?:{'|'.join(PACKAGES)})/(?:[\w/]*\.py|[\w/]*))\)",
        to_reference,
        text[0],
    )
    text[0] = re.sub(r"\[([^\]]+)\]\((?:(?:\.\./)*tests/[^)]*|CITATION\.cff)\)", r"`\1`", text[0])
    text[0] = re.sub(
        r"\]\((CONTRIBUTING|CHANGELOG)\.md\)", lambda link: f"](docs/{link[1].lower()}.md)", text[0]
    )


def as_typed(app: Sphinx, tree: nodes.document) -> None:
    """Cells look like the shell or the file that they are, long values are left out; formulas are
    checked."""
    for block in tree.findall(nodes.literal_block):
        first, _, rest = block.astext().partition("\n")
        if first.startswith("!"):
            block[:] = [nodes.Text(re.sub(r"^!", "$ ", block.astext(), flags=re.MULTILINE))]
            block["language"] = "console"
        elif first.startswith("%%writefile "):
            block[:] = [nodes.Text(rest)]
            suffix = first.rpartition(".")[2]
            block["language"] = {"csv": "text"}.get(suffix, suffix)  # tables have no highlighter
        elif first.startswith("%config "):
            block[:] = [nodes.Text(rest.lstrip())]
        block.rawsource = block.astext()
    for said in list(tree.findall(addnodes.desc_annotation)):
        # a table, which its module shows better
        if said.astext().startswith(" = ") and len(said.astext()) > 100:
            said.parent.remove(said)
    entry: addnodes.desc | None = None
    # constants that are declared together have one text
    for each in list(tree.findall(addnodes.desc)):
        if (
            entry
            and each["objtype"] == entry["objtype"] == "data"
            and each[-1].astext() == entry[-1].astext() != ""
        ):
            entry[-1:-1] = each[:-1]
            each.parent.remove(each)
        else:
            entry = each
    for formula in tree.findall(lambda node: isinstance(node, nodes.math | nodes.math_block)):
        try:
            latex2mathml.tex2mathml(formula.astext())
        except MathError as error:
            log.warning("formula %s: %s", formula.astext(), error, location=formula)


_AS_IT_IS = (
    nodes.FixedTextElement,
    nodes.literal,
    nodes.math,
    nodes.title,
    nodes.raw,
    addnodes.desc_signature,
)


def symbols(app: Sphinx, tree: nodes.document) -> None:
    """Symbols in running text are set as on the pages of results; code, titles and docstrings stay
    as they are."""
    if app.env.docname.startswith("api/"):
        return
    for text in list(tree.findall(nodes.Text)):
        up, shown = text.parent, typeset(text.astext())
        while up and not isinstance(up, _AS_IT_IS):
            up = up.parent
        if up is None and "<" in shown:
            text.parent.replace(text, nodes.raw("", shown, format="html"))


def docstring(
    app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]
) -> None:
    """Plain text with `names` between backticks and sections of numpy's kind, as
    reStructuredText."""
    # says nothing
    text = "" if lines[:1] and lines[0].startswith("Alias for field number") else "\n".join(lines)
    text = re.sub(r"^(\w+)\n-{3,}$", r"**\1**\n", text, flags=re.MULTILINE)
    text = re.sub(r"^(\w[\w, ]*) : ", r"``\1``\n    ", text, flags=re.MULTILINE)
    text = re.sub(r"(^\S.*\n)\n(?= {4}\S)", r"\1\n::\n\n", text, flags=re.MULTILINE)
    lines[:] = literal_bars(text).split("\n")


def literal_bars(text: str) -> str:
    """Text in which |x| is an absolute value and no substitution; code and formulas stay as they
    are."""
    code = r"(^::\n\n(?:(?: {4}.*)?(?:\n|\Z))+|``.+?``|`[^`]*`)"
    return re.sub(rf"{code}|\|", lambda part: part[1] or r"\|", text, flags=re.MULTILINE)


def signature(
    app: Sphinx,
    what: str,
    name: str,
    obj: object,
    options: object,
    arguments: str | None,
    returned: str | None,
) -> tuple[str | None, str | None]:
    """Aliases of types by their names."""
    array = "ndarray[tuple[Any, ...], dtype[float64]]"
    given = [text and text.replace(array, "Array") for text in (arguments, returned)]
    short = [text and re.sub(r"TypeAliasForwardRef\('(\w+)'\)", r"\1", text) for text in given]
    return short[0], short[1]


def found_once(app: Sphinx, env: BuildEnvironment) -> None:
    """What a name stands for is looked up once: each time anew it goes through all names."""
    domain = env.domains.python_domain
    domain.find_obj = functools.cache(domain.find_obj)


def setup(app: Sphinx) -> None:
    """Connect what is done here."""
    app.connect("builder-inited", reference)
    app.connect("build-finished", site)
    app.connect("source-read", source_links)
    app.connect("include-read", source_links)
    app.connect("doctree-read", as_typed)
    app.connect("doctree-read", symbols)
    app.connect("env-check-consistency", found_once)
    app.connect("autodoc-process-docstring", docstring)
    app.connect("autodoc-process-signature", signature)
