"""The page's head names every module that its scripts import."""

from cocalib.platform.resources import static_folder
from cocalib.web.port.routes import with_preloaded_modules

PAGE = '<head><script type="module" src="a.js"></script></head><body></body>'


def test_modules_are_found_through_the_modules_that_import_them(tmp_path):
    (tmp_path / "in").mkdir()
    (tmp_path / "a.js").write_text('import { x } from "./in/b.js";\nimport "./c.js";\n')
    (tmp_path / "in" / "b.js").write_text(
        'import {\n  y,\n  z,\n} from "./d.js";\nexport const x = () => import("./late.js");\n'
    )
    (tmp_path / "c.js").write_text('export * from "./a.js";\nconst text = `\n  import no from "./none.js"`;\n')
    (tmp_path / "in" / "d.js").write_text("")
    links = "".join(f'<link rel="modulepreload" href="{name}.js">' for name in ("a", "in/b", "in/d", "c"))
    assert with_preloaded_modules(PAGE, tmp_path) == PAGE.replace("</head>", f"{links}</head>")


def test_a_page_without_modules_stays_as_it_is(tmp_path):
    assert with_preloaded_modules("<head></head>", tmp_path) == "<head></head>"


def test_all_our_modules_but_those_of_other_pages_are_named():
    folder = static_folder()
    page = with_preloaded_modules((folder / "index.html").read_text(encoding="utf-8"), folder)
    ours = {path.relative_to(folder).as_posix() for path in folder.rglob("*.js")}
    assert {name for name in ours if f'modulepreload" href="{name}"' in page} >= ours - {"space/pace.js"}
