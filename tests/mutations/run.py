#!/usr/bin/env python3
"""Runs the tests on mutated headers: a mutation that no test notices is a gap in the tests.

usage: tests/mutations/run.py [--list FILE] [--jobs N] [--only TEXT] [--verbose]

The list (tests/mutations/list.txt) holds entries of this form; the original must stand in the header once:

    @ detail/core/statistics.hpp | test_statistics          header, test files that must notice
    - return *middle;
    + return values.front();
    ? why nothing can notice it                             only where it is known to survive

Where original and mutant differ in an expression, both are compiled, and the environment chooses: the tests are
then compiled once for all mutations of that kind. Other mutations are compiled one by one.

Needs a build in build/release (tests/run.sh). --verbose prints the test cases that noticed each mutation. Exit
status 1 where fewer than 92 % are killed, or where one that is said to survive is killed. A mutant that does
not compile is a fault of the list.
"""
import argparse, concurrent.futures, os, re, shutil, subprocess, sys, tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
# The tests are compiled with headers alone, and linked first: mutated functions come before those of libraries.
LIBRARIES = [os.path.join(ROOT, 'build/release', name)
             for name in ('examples/libglobalmatch_support.a', 'libglobalmatch_compiled.a')]
SECONDS = 600  # a mutant that runs longer counts as killed
SWITCH = '''#pragma once
#include <cstdlib>
inline const int mutation_number = std::getenv("MUTATION") ? std::atoi(std::getenv("MUTATION")) : 0;
'''


def read_list(path):
    mutations = []
    for number, line in enumerate(open(path, encoding='utf-8'), 1):
        line = line.rstrip('\n')
        if not line or line.startswith('#'):
            continue
        mark, text = line[:2], line[2:]
        if mark == '@ ':
            header, tests = (part.strip() for part in text.split('|'))
            mutations.append({'line': number, 'header': header, 'tests': tests.split(), 'from': [], 'to': [], 'why': ''})
        elif mark.strip() == '-':
            mutations[-1]['from'].append(text)
        elif mark.strip() == '+':
            mutations[-1]['to'].append(text)
        elif mark == '? ':
            mutations[-1]['why'] = text
        else:
            sys.exit(f'{path}:{number}: not an entry of the list: {line}')
    return mutations


def replaced(source, mutation, lines):
    """The source with `lines` for those of the mutation, whatever their indentation; None unless they occur once."""
    text, wanted = source.split('\n'), [line.strip() for line in mutation['from']]
    places = [i for i in range(len(text) - len(wanted) + 1) if [l.strip() for l in text[i:i + len(wanted)]] == wanted]
    if len(places) != 1:
        return None
    return '\n'.join(text[:places[0]] + lines + text[places[0] + len(wanted):])


def without_comment(lines):
    return ' '.join(re.sub(r'\s*//.*', '', line).strip() for line in lines)


def places_before(text, begin):
    """Where an expression that holds text[begin:] may start, the nearest first."""
    depth = 0
    for at in range(begin, 0, -1):
        before = text[at - 1]
        if before in ')]}':
            depth += 1
        elif before in '([{':
            depth -= 1
        starts = before in '([,;{' or text[at] != '=' and re.search(r'(\breturn|[^=!<>]=)$', text[:at])
        if depth <= 0 and starts:
            depth = 0
            yield at


def places_after(text, end):
    """Where an expression that holds text[:end] may end, the nearest first."""
    depth = 0
    for at in range(end, len(text)):
        if depth <= 0 and text[at] in ')]},;':
            depth = 0
            yield at
        depth += (text[at] in '([{') - (text[at] in ')]}')


def is_balanced(text):
    depth = 0
    for character in text:
        depth += (character in '([{') - (character in ')]}')
        if depth < 0:
            return False
    return depth == 0


def is_expression(text):
    """Whether brackets match and no comma stands outside of them."""
    while (inner := re.sub(r'\([^()]*\)|\[[^\[\]]*\]|\{[^{}]*\}', '', text)) != text:
        text = inner
    return not re.search(r'[][(){},;]|\breturn\b|^\s*=|^\s*$', text) or False


def switched(mutation, number):
    """The line with both forms; None where they differ neither in one expression nor in one statement."""
    old, new = without_comment(mutation['from']), without_comment(mutation['to'])
    if not old.endswith(';') and ';' in old + new and not is_balanced(old):
        return None
    if re.match(r'return\b.*;$', old) and new.startswith('return') and is_balanced(old):
        return f'if (mutation_number == {number}) {{ {new} }} {old}'
    begin = len(os.path.commonprefix([old, new]))
    end = len(os.path.commonprefix([old[begin:][::-1], new[begin:][::-1]]))
    lefts, rights = list(places_before(old, begin))[:4], list(places_after(old, len(old) - end))[:4]
    for left, right in sorted(((l, r) for l in lefts for r in rights), key=lambda p: p[1] - p[0]):
        tail = len(old) - right
        first, second = old[left:right], new[left:len(new) - tail]
        if is_balanced(first) and is_balanced(second) and is_expression(first) and is_expression(second):
            return f'{old[:left]} (mutation_number == {number} ? ({second}) : ({first})) {old[right:]}'
    declaration = r'(const|constexpr|static|auto|double|float|int|bool|std::size_t|vec2|vec3|mat2|mat3|else|for|while)\b'
    if all(t.endswith(';') and is_balanced(t) and re.search(r'=|\+\+', t) and not re.match(declaration, t)
           for t in (old, new)):
        return f'if (mutation_number == {number}) {{ {new} }} else {{ {old} }}'
    return None


def command(include, source, output):
    eigen = os.environ.get('EIGEN_INCLUDE', '/usr/include/eigen3')
    data = f'-DGLOBALMATCH_SHARED_DATA="{ROOT}/../shared/data"'
    return ['c++', '-std=c++20', '-O1', '-w', '-pthread', data, '-I', include, '-I', f'{ROOT}/tests', '-I',
            f'{ROOT}/examples', '-I', f'{ROOT}/benchmarks', '-isystem', eigen, '-isystem', '/usr/include/catch2', '-c', source, '-o', output]


def compile_test(include, test, output):
    """None, or what the compiler says."""
    compiled = subprocess.run(command(include, f'{ROOT}/tests/{test}.cpp', output), capture_output=True, text=True)
    return None if compiled.returncode == 0 else compiled.stderr or 'does not compile'


def first_error(text):
    return next((l for l in text.split('\n') if 'error' in l), text[:200])


def link(objects, program):
    subprocess.run(['c++', '-pthread', *objects, *LIBRARIES, '-o', program], check=True)


def run(program, number, folder):
    """'survived', or 'killed' with the titles of the test cases."""
    try:
        done = subprocess.run([program, '~[slow]', '-r', 'xml'], capture_output=True, timeout=SECONDS, cwd=folder,
                              encoding='utf-8', errors='replace', env={**os.environ, 'MUTATION': str(number)})
    except subprocess.TimeoutExpired:
        return 'killed', ['does not end']
    cases = re.findall(r'<TestCase name="(.*?)".*?<OverallResult success="(true|false)"', done.stdout, re.DOTALL)
    failed = [name for name, success in cases if success == 'false']
    return ('survived', []) if done.returncode == 0 else ('killed', failed or ['crashes'])


class built_test:
    """A test with the headers as they are and all mutations of it that can be switched on."""

    def __init__(self, test, mutations, folder, main_object):
        self.folder = tempfile.mkdtemp(dir=folder)
        self.program = os.path.join(self.folder, test)
        self.numbers = {}
        candidates = [m for m in mutations if test in m['tests'] and switched(m, 1)]
        while True:
            error = self.build(test, candidates, main_object)
            if not error:
                break
            wrong = set(re.findall(r'globalmatch/(\S+?hpp):(\d+):\d+: (?:error|  required)', error))
            at_fault = [m for m in candidates if (m['header'], str(self.place.get(m['line']))) in wrong]
            if not at_fault and not candidates:
                sys.exit(f'{test}: {first_error(error)}')
            candidates = [m for m in candidates if m not in at_fault] if at_fault else []
        if run(self.program, 0, self.folder)[0] != 'survived':
            sys.exit(f'{test} does not pass without mutations')

    def build(self, test, candidates, main_object):
        include = os.path.join(self.folder, 'include')
        shutil.rmtree(include, ignore_errors=True)
        shutil.copytree(os.path.join(ROOT, 'include'), include)
        open(os.path.join(include, 'mutation_number.hpp'), 'w', encoding='utf-8').write(SWITCH)
        self.numbers, self.place = {}, {}
        for m in candidates:
            path = os.path.join(include, 'globalmatch', m['header'])
            text = open(path, encoding='utf-8').read()
            # Kept on as many lines, so that all others stay where they are.
            line = [switched(m, m['line'])] + [''] * (len(m['from']) - 1)
            changed = replaced(text, m, line)
            if changed is None:
                continue
            self.place[m['line']] = 1 + changed.split('\n').index(line[0])
            if not changed.startswith('//') and not changed.startswith('#include "mutation'):
                sys.exit(f"{m['header']}: does not begin with a comment")
            changed = '#include "mutation_number.hpp"\n' + changed.split('\n', 1)[1]
            open(path, 'w', encoding='utf-8').write(changed)
            self.numbers[m['line']] = m['line']
        own = os.path.join(self.folder, 'test.o')
        error = compile_test(include, test, own)
        if not error:
            link([main_object, own], self.program)
        return error


def compile_alone(mutation, test, folder, main_object):
    """What became of a mutation that is compiled by itself."""
    folder = tempfile.mkdtemp(dir=folder)
    include = os.path.join(folder, 'include')
    shutil.copytree(os.path.join(ROOT, 'include'), include)
    path = os.path.join(include, 'globalmatch', mutation['header'])
    text = replaced(open(path, encoding='utf-8').read(), mutation, mutation['to'])
    if text is None:
        return 'the original does not stand in the header once', []
    open(path, 'w', encoding='utf-8').write(text)
    own, program = os.path.join(folder, 'test.o'), os.path.join(folder, test)
    if error := compile_test(include, test, own):
        return first_error(error), []
    link([main_object, own], program)
    return run(program, 0, folder)


def try_mutation(mutation, built, folder, main_object):
    """What became of it, and the titles of the test cases that noticed."""
    for test in mutation['tests']:
        number = built[test].numbers.get(mutation['line'])
        if number:
            result, cases = run(built[test].program, number, built[test].folder)
        else:
            result, cases = compile_alone(mutation, test, folder, main_object)
        if result != 'survived':
            return result, cases
    return 'survived', []


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--list', default=os.path.join(ROOT, 'tests/mutations/list.txt'))
    parser.add_argument('--jobs', type=int, default=os.cpu_count())
    parser.add_argument('--only', default='', help='entries whose header or tests contain this')
    parser.add_argument('--verbose', action='store_true', help='print what noticed each mutation')
    arguments = parser.parse_args()
    mutations = [m for m in read_list(arguments.list) if arguments.only in m['header'] + ' ' + ' '.join(m['tests'])]
    folder = tempfile.mkdtemp()
    main_object = os.path.join(folder, 'main.o')
    if error := compile_test(f'{ROOT}/include', 'main', main_object):
        sys.exit(first_error(error))
    tests = sorted({t for m in mutations for t in m['tests']})

    def attempt(mutation):
        result, cases = try_mutation(mutation, built, folder, main_object)
        if arguments.verbose:
            print(f"line {mutation['line']}: {result}: {'; '.join(cases)}", flush=True)
        return result

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        built = dict(zip(tests, pool.map(lambda t: built_test(t, mutations, folder, main_object), tests)))
        results = list(pool.map(attempt, mutations))
    shutil.rmtree(folder)
    killed, faults = 0, 0
    for mutation, result in zip(mutations, results):
        killed += result == 'killed'
        wrong = result not in ('killed', 'survived') or (result == 'killed' and mutation['why'])
        faults += bool(wrong)
        if result != 'killed' or wrong:
            print(f"line {mutation['line']}: {mutation['header']}: {result}  {mutation['why']}")
            print('\n'.join('  - ' + l for l in mutation['from']) + '\n' + '\n'.join('  + ' + l for l in mutation['to']))
    print(f'{killed} of {len(mutations)} mutations killed')
    sys.exit(faults > 0 or not mutations or killed < 0.92 * len(mutations))


if __name__ == '__main__':
    main()
