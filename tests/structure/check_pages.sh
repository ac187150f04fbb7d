#!/usr/bin/env bash
# The tables of docs/architecture.md name every header, and no other; its limits of compile time are those of
# benchmarks/compile_time.sh; what docs/constants.md names is in the header that it names; lines of prose in docs/
# have at most 110 columns; links between pages lead to a file, and to a heading of it.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
python3 - <<'P'
import glob, os, re, sys
text, bad = open('docs/architecture.md', encoding='utf-8').read(), []
tables = re.split(r'\n\n', text[text.index('## Headers'):text.index('## Rules')])
named = set()
for table in tables:
    head = re.match(r'\| (?:`(detail/\w+)/`|public header) \|', table)
    if not head: continue
    folder = head[1] + '/' if head[1] else ''
    for row in table.split('\n')[2:]:
        named |= {folder + name + '.hpp' for name in re.findall(r'`(\w+)`', row.split('|')[1])}
there = {p.removeprefix('include/globalmatch/') for p in glob.glob('include/globalmatch/**/*.hpp', recursive=True)}
bad += [f'docs/architecture.md does not name {h}' for h in sorted(there - named)]
bad += [f'docs/architecture.md names {h}, which is not there' for h in sorted(named - there)]
limits = {m[1]: (m[2], m[3]) for m in re.finditer(r'  \| `(\w+)`.* \| ([\d.]+) \| ([\d.]+) GB', text)}
script = open('benchmarks/compile_time.sh', encoding='utf-8').read()
for name, (ratio, memory) in limits.items():
    if not re.search(rf'\b{name}\b.*\) echo {re.escape(ratio)} {re.escape(memory)}', script):
        bad.append(f'{name}: benchmarks/compile_time.sh has another limit')
if not limits: bad.append('docs/architecture.md has no limits of compile time')
for row in re.findall(r'^\| (?!constant|---)(.*) \|$', open('docs/constants.md', encoding='utf-8').read(), re.M):
    cells = row.split(' | ')
    header = 'include/globalmatch/' + cells[2].strip('`') + '.hpp'
    if header.removeprefix('include/globalmatch/') not in there: bad.append(f'docs/constants.md: no {header}')
    else:
        code = open(header, encoding='utf-8').read()
        bad += [f'docs/constants.md: {header} has no {n}' for n in re.findall(r'`(\w+)`', cells[0]) if not re.search(rf'\b{n}\b', code)]
pages = glob.glob('docs/**/*.md', recursive=True) + ['README.md', 'CONTRIBUTING.md', 'CHANGELOG.md']
for page in pages:
    for number, line in enumerate(open(page, encoding='utf-8'), 1):
        if len(line.rstrip('\n')) > 110 and not line.lstrip().startswith(('|', '!', '`', 'for (')):
            bad.append(f'{page}:{number}: {len(line)} columns')
def without_code(page): return re.sub(r'^```.*?^```', '', open(page, encoding='utf-8').read(), flags=re.M | re.S)
def anchors(page):  # as GitHub makes them
    return {re.sub(r'[^\w\- ]', '', h.strip().lower()).replace(' ', '-') for h in re.findall(r'^#+ (.*)$', without_code(page), re.M)}
for page in pages:
    for link in re.findall(r'\]\(([^()\s]+)\)', without_code(page)):
        path, _, anchor = link.partition('#')
        if re.match(r'\w+:', link): continue
        target = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        if not os.path.exists(target): bad.append(f'{page}: no {link}')
        elif anchor and anchor not in anchors(target): bad.append(f'{page}: no heading {link}')
version = re.search(r'VERSION ([\d.]+)', open('CMakeLists.txt', encoding='utf-8').read().split('project(')[1])[1]
for file, mark in (('CITATION.cff', 'version: '), ('packaging/vcpkg/globalmatch/vcpkg.json', '"version": "')):
    if mark + version not in open(file, encoding='utf-8').read(): bad.append(f'{file}: has another version than {version}')
print('\n'.join(bad) or 'pages agree with headers and limits')
sys.exit(bool(bad))
P
