"""Packs the extension: python editors/vscode/build_vsix.py [FOLDER].  Needs no network and nothing but Python.

Writes fbvm-VERSION.vsix into the folder (default: the present one).  A .vsix is a ZIP with the extension's files, a manifest of
them, and the types of its files; two runs over the same files write the same bytes."""

from __future__ import annotations

import json
import sys
import zipfile
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr

HERE = Path(__file__).resolve().parent
FILES = ("package.json", "extension.js", "client.js", "debugging.js", "features.js", "tests.js",
         "language-configuration.json", "snippets.json",
         "README.md", "syntaxes/st.tmLanguage.json", "syntaxes/mnemonics.tmLanguage.json", "syntaxes/drawing.tmLanguage.json",
         "syntaxes/twincat.tmLanguage.json",
         "walkthrough/install.md", "walkthrough/write.md", "walkthrough/run.md", "walkthrough/debug.md", "walkthrough/test.md")
"""What the extension consists of."""
TYPES = {".json": "application/json", ".js": "application/javascript", ".md": "text/markdown", ".txt": "text/plain",
         ".vsixmanifest": "text/xml"}
LONG_AGO = (2020, 1, 1, 0, 0, 0)
"""The time of all files in the ZIP, so that the package says what it holds and not when it was made."""


def manifest(package: dict[str, object]) -> str:
    """`extension.vsixmanifest`, which says what VS Code shows of an extension."""
    engine = package["engines"]["vscode"]  # type: ignore[index]
    return f"""<?xml version="1.0" encoding="utf-8"?>
<PackageManifest Version="2.0.0" xmlns="http://schemas.microsoft.com/developer/vsx-schema/2011">
  <Metadata>
    <Identity Language="en-US" Id={quoteattr(str(package["name"]))} Version={quoteattr(str(package["version"]))} \
Publisher={quoteattr(str(package["publisher"]))} />
    <DisplayName>{escape(str(package["displayName"]))}</DisplayName>
    <Description xml:space="preserve">{escape(str(package["description"]))}</Description>
    <Tags>{escape(",".join(package["keywords"]))}</Tags>
    <Categories>{escape(",".join(package["categories"]))}</Categories>
    <Properties>
      <Property Id="Microsoft.VisualStudio.Code.Engine" Value={quoteattr(str(engine))} />
      <Property Id="Microsoft.VisualStudio.Code.ExtensionDependencies" Value="" />
      <Property Id="Microsoft.VisualStudio.Code.ExtensionKind" Value="workspace" />
    </Properties>
    <License>extension/LICENSE.txt</License>
  </Metadata>
  <Installation><InstallationTarget Id="Microsoft.VisualStudio.Code" /></Installation>
  <Dependencies />
  <Assets>
    <Asset Type="Microsoft.VisualStudio.Code.Manifest" Path="extension/package.json" Addressable="true" />
    <Asset Type="Microsoft.VisualStudio.Services.Content.Details" Path="extension/readme.md" Addressable="true" />
    <Asset Type="Microsoft.VisualStudio.Services.Content.License" Path="extension/LICENSE.txt" Addressable="true" />
  </Assets>
</PackageManifest>
"""


def build(folder: Path) -> Path:
    """Write the package into a folder; returns its path."""
    package = json.loads((HERE / "package.json").read_text(encoding="utf-8"))
    types = "".join(f'<Default Extension="{end}" ContentType="{kind}" />' for end, kind in TYPES.items())
    held = {
        "extension.vsixmanifest": manifest(package),
        "[Content_Types].xml": '<?xml version="1.0" encoding="utf-8"?>\n'
                               f'<Types xmlns="http://schemas.openxmlformats.org/package/2006/content-types">{types}</Types>\n',
        "extension/LICENSE.txt": (HERE.parents[1] / "LICENSE").read_text(encoding="utf-8"),
        **{f"extension/{name.lower() if name == 'README.md' else name}": (HERE / name).read_text(encoding="utf-8")
           for name in FILES}}
    made = folder / f"{package['name']}-{package['version']}.vsix"
    with zipfile.ZipFile(made, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in held.items():
            archive.writestr(zipfile.ZipInfo(name, LONG_AGO), text.encode(), zipfile.ZIP_DEFLATED)
    return made


if __name__ == "__main__":
    print(build(Path(sys.argv[1] if len(sys.argv) > 1 else ".")))
