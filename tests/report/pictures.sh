#!/usr/bin/env bash
# The pictures of docs/reports.md, from the screenshots that run.sh has left in build/report. Needs ImageMagick.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
# picture NAME SCREENSHOT PART, which is width x height + left + top
picture() {
  convert "build/report/$2.png" -crop "$3" +repage -resize 900x -strip +dither -colors 128 "PNG8:docs/report/$1.png"
}
picture good good_whole 1280x1260+0+0
picture points good_dark 1280x2060+0+1200
picture ambiguous ambiguous_whole 1280x1330+0+0
picture failed failed_light 1280x560+0+0
picture survey survey_whole 1280x1590+0+0
