#!/usr/bin/env bash
# Headers over 350 lines, functions over 60 lines, and control flow nested deeper than 5 levels in a function (the
# body itself is level 1; braces of namespaces, classes and initialisers do not count); examples over 60 lines and
# programs over 150. Fails when there are any.
set -euo pipefail
cd "$(dirname "${BASH_SOURCE[0]}")/../.."
python3 - <<'P'
import glob, re, sys
bad = []
for path in sorted(glob.glob('include/globalmatch/**/*.hpp', recursive=True)):
    text = open(path, encoding='utf-8').read()
    if text.count('\n') > 350: bad.append(f'{path}: {text.count(chr(10))} lines')
    t = re.sub(r'//[^\n]*', '', text)
    t = re.sub(r'"(?:\\.|[^"\\\n])*"|(?<!\w)\'(?:\\.|[^\'\\\n])\'', '0', t)
    t = re.sub(r'^[ \t]*#[^\n]*', '', t, flags=re.M)
    stack, head, line, start, first, parens = [], '', 1, 1, 0, 0
    for c in t:
        if c == '\n': line += 1
        if c == '{':
            flow = re.search(r'\b(if|for|while|switch)\s*(constexpr\s*)?\(.*\)\s*$|\b(else|do|try)\s*$|\bcatch\s*\(.*\)\s*$', head, re.S)
            scope = re.search(r'\b(namespace|struct|class|enum|union|concept)\b[^()]*$', head)
            lam = re.search(r'\][^\[\]]*$', head, re.S) and re.search(r'\)\s*(mutable\s*|->[^;{]*)?$|\]\s*$', head)
            body = not scope and not parens and re.search(r'\)[^()=]*$|\)\s*:\s', head, re.S) and not any(s[0] in 'fl' for s in stack)
            kind = 's' if scope else 'l' if flow or (lam and any(s[0] in 'fl' for s in stack)) else 'f' if body else '-'
            stack.append((kind, start, parens, head.strip().split('\n')[0][:60])); parens = 0
            deep = sum(s[0] in 'fl' for s in stack)
            if deep > 5 and kind == 'l': bad.append(f'{path}:{line}: nested {deep} deep')
            head = ''
        elif c == '}':
            kind, begun, parens, name = stack.pop()
            if kind == 'f' and line - begun + 1 > 60: bad.append(f'{path}:{begun}: {line - begun + 1} lines: {name}')
            if not parens: head = ''
        elif c == ';' and not parens: head = ''
        else:
            parens += (c == '(') - (c == ')')
            if not head.strip() and c.strip(): start, head = line, ''
            head += c
for pattern, limit in (('examples/0*.cpp', 60), ('examples/programs/*.cpp', 150)):
    for path in glob.glob(pattern):
        lines = open(path, encoding='utf-8').read().count('\n')
        if lines > limit: bad.append(f'{path}: {lines} lines, at most {limit}')
print('\n'.join(bad) or 'no long header, function or example, nothing nested too deep')
sys.exit(bool(bad))
P
