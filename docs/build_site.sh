#!/usr/bin/env bash
# Builds the documentation site, pages and API, searchable, in build/site. Installs what is missing. Fails where
# a public class, function or enumeration has no comment, and where a link leads nowhere. (Members of a struct
# need none where their names say it.)
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/.."
source cmake/setup.sh

install_missing doxygen doxygen-awesome-css python3
rm -rf build/site
mkdir -p build
doxygen docs/site/Doxyfile
cp LICENSE CITATION.cff examples/0*.cpp docs/*.svg docs/*/*.svg docs/*/*.csv build/site

warnings=$(grep -vE 'Member .* of (struct|class) .* is not documented' build/site_warnings.txt || true)
if [ -n "$warnings" ]; then echo "$warnings" && exit 1; fi
python3 docs/site/check_links.py build/site
echo "Open $PWD/build/site/index.html"
