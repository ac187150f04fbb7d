#!/usr/bin/env bash
# Bundles the 3-D view of reports and three.js into one script, with the licence of the latter.
# usage: build.sh FOLDER      writes FOLDER/view_3d.js; needs npm and its registry
set -euo pipefail
here=$(cd "$(dirname "${BASH_SOURCE[0]}")" && pwd)
work=$1/npm
mkdir -p "$work"
cp "$here/package.json" "$here/view_3d.js" "$work"
cd "$work"
npm install --silent --no-audit --no-fund --no-package-lock
node_modules/.bin/esbuild view_3d.js --bundle --minify --format=iife --target=es2020 --log-level=warning \
  --banner:js="/*! This script contains three.js:
$(cat node_modules/three/LICENSE)
*/" --outfile=../view_3d.new.js
if grep -q '</script\|<!--' ../view_3d.new.js; then
  echo "The bundle cannot stand in a page: it holds </script or <!--." >&2
  exit 1
fi
mv ../view_3d.new.js ../view_3d.js
