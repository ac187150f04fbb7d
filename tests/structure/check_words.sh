#!/usr/bin/env bash
# Fails for words of docs/words.txt in include/, examples/, docs/ and README.md that none of its `allow` lines
# covers, and for more than 20 `allow` lines. Part 1 is looked for everywhere; `identifier` lines only in code
# and in `backticks`.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
words=docs/words.txt
always=$(grep -vP '^(#|$|identifier\t|allow\t)' "$words" | paste -sd'|')
identifier=$(grep -P '^identifier\t' "$words" | cut -f2 | paste -sd'|')
mapfile -t files < <(git ls-files -co --exclude-standard include examples docs README.md |
  grep -E '\.(hpp|cpp|md|sh|txt)$' | grep -vx "$words")

# Lines of code without comments and strings; of other text only what stands in `backticks`.
code() {
  local file
  for file in "${files[@]}"; do
    case $file in
      *.md) grep -noP '`[^`]+`' "$file" || true ;;
      *) sed -E 's|//.*||; s/"(\\.|[^"\\])*"//g; s/^ *#.*//' "$file" | grep -n . || true ;;
    esac | sed "s|^|$file:|"
  done
}
found=$({
  grep -nPiH "(?<![\w/.-])($always)(?!\w)" "${files[@]}" || true
  code | grep -P ":[0-9]+:.*(?<![\w:.])($identifier)(?![\w(]*::)\b" || true
} | sort -u)
while IFS=$'\t' read -r _ file pattern _; do
  found=$(grep -vP "^\Q$file\E:[0-9]+:.*($pattern)" <<<"$found" || true)
done < <(grep -P '^allow\t' "$words")
count=$(grep -c . <<<"$found" || true) allowed=$(grep -cP '^allow\t' "$words" || true)
if [ -n "$found" ]; then echo "$found"; fi
echo "$count words that are not allowed, $allowed exceptions of at most 20"
[ "$count" -eq 0 ] && [ "$allowed" -le 20 ]
