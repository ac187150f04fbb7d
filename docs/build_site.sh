#!/usr/bin/env bash
# Builds the documentation site, pages and API, searchable, in build/site. Installs what is missing. Fails
# where a public class, an enumeration, or a function that is no member has no comment, and where a link leads
# nowhere. (Members need none where their names say it.)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source cmake/setup.sh

install_missing doxygen doxygen-awesome-css python3
if ! is_command doxygen; then # there is no apt-get, either
  echo "Please install Doxygen 1.9.4 or newer, and doxygen-awesome.css in /usr/share/doxygen-awesome-css." >&2
  exit 2
fi
rm -rf build/site build/site_warnings.txt
mkdir -p build
doxygen docs/site/Doxyfile
cp LICENSE CITATION.cff examples/0*.cpp docs/*.svg docs/*/*.svg docs/*/*.csv build/site

if [ ! -e build/site_warnings.txt ]; then
  echo "Doxygen has left no build/site_warnings.txt, by which missing comments are found." >&2
  exit 1
fi
members='Member .* \((variable|function|friend|typedef)\) of (struct|class) .* is not documented'
warnings=$(grep -vE "$members" build/site_warnings.txt || true)
if [ -n "$warnings" ]; then echo "$warnings" && exit 1; fi
python3 docs/site/check_links.py build/site
echo "Open $PWD/build/site/index.html"
