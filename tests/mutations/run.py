#!/usr/bin/env python3
"""Runs the tests on mutated headers: a mutation that no test notices is a gap in the tests.

usage: tests/mutations/run.py [--list FILE] [--jobs N] [--only TEXT] [--verbose]

The list (tests/mutations/list.txt) holds entries of this form; the original must stand in the header once:

    @ detail/core/statistics.hpp | test_statistics          header, test files that must notice
    - return *middle;
    + return values.front();
    ? why nothing can notice it                             only where it is known to survive

Needs a build in build/release (tests/run.sh). --verbose prints the test cases that noticed each mutation. Exit status 1 where fewer than 92 % are killed, or where one
that is said to survive is killed. A mutant that does not compile is a fault of the list.
"""
import argparse, concurrent.futures, os, re, shutil, subprocess, sys, tempfile

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
CXX = subprocess.run(['c++', '--version'], capture_output=True, text=True).stdout
SUPPORT = os.path.join(ROOT, 'build/release/examples/libglobalmatch_support.a')
SECONDS = 600  # a mutant that runs longer counts as killed
# Calls of inline functions stay calls, and nothing is concluded from their bodies.
CALLS = ['-fno-inline', '-fno-ipa-pure-const', '-fno-ipa-reference', '-fno-ipa-modref', '-fno-ipa-ra', '-fno-ipa-cp',
         '-fno-ipa-sra', '-fno-ipa-icf', '-fno-ipa-vrp', '-fno-ipa-bit-cp'] if 'clang' not in CXX else ['-fno-inline']


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


def mutated(source, mutation):
    """The source with the lines of the mutation replaced, whatever their indentation; None unless they occur once."""
    lines, wanted = source.split('\n'), [line.strip() for line in mutation['from']]
    places = [i for i in range(len(lines) - len(wanted) + 1) if [l.strip() for l in lines[i:i + len(wanted)]] == wanted]
    if len(places) != 1:
        return None
    return '\n'.join(lines[:places[0]] + mutation['to'] + lines[places[0] + len(wanted):])


def command(include, source, output, *more):
    eigen = os.environ.get('EIGEN_INCLUDE', '/usr/include/eigen3')
    data = f'-DGLOBALMATCH_SHARED_DATA="{ROOT}/../shared/data"'
    return ['c++', '-std=c++20', '-O1', *CALLS, '-pthread', data, '-I', include, '-I', f'{ROOT}/tests',
            '-I', f'{ROOT}/examples', '-isystem', eigen, '-isystem', '/usr/include/catch2', *more, '-c', source, '-o', output]


def source_of(test):
    return f'{ROOT}/tests/{test}.cpp'


def compile_object(include, source, output, *more):
    """None, or the compiler's first error."""
    compiled = subprocess.run(command(include, source, output, *more), capture_output=True, text=True)
    if compiled.returncode == 0:
        return None
    return next((l for l in compiled.stderr.split('\n') if 'error' in l), 'does not compile')


def run_objects(objects, folder):
    """'passed', or 'failed' with the titles of the test cases."""
    program = os.path.join(folder, 'program')
    subprocess.run(['c++', '-pthread', *objects, SUPPORT, '-o', program], check=True)
    try:
        run = subprocess.run([program, '~[slow]', '-r', 'xml'], capture_output=True, timeout=SECONDS, cwd=folder,
                             encoding='utf-8', errors='replace')
    except subprocess.TimeoutExpired:
        return 'failed', ['does not end']
    cases = re.findall(r'<TestCase name="(.*?)".*?<OverallResult success="(true|false)"', run.stdout, re.DOTALL)
    failed = [name for name, success in cases if success == 'false']
    return ('passed', []) if run.returncode == 0 else ('failed', failed or ['crashes'])


class built_tests:
    """The tests compiled once. A mutant of a header is compiled alone, and its functions are linked before theirs."""

    def __init__(self, folder, tests, pool):
        self.folder = folder
        self.object = {t: os.path.join(folder, t + '.o') for t in ['main', *tests]}
        errors = list(pool.map(lambda t: compile_object(f'{ROOT}/include', source_of(t), self.object[t]), self.object))
        for test, error in zip(self.object, errors):
            if error:
                sys.exit(f'{test}: {error}')

    def run(self, test, folder, before=()):
        return run_objects([*before, self.object['main'], self.object[test]], folder)


def try_mutation(mutation, built):
    """What became of it, and the titles of the test cases that noticed."""
    folder = tempfile.mkdtemp()
    try:
        include = os.path.join(folder, 'include')
        shutil.copytree(os.path.join(ROOT, 'include'), include)
        header = os.path.join(include, 'globalmatch', mutation['header'])
        text = mutated(open(header, encoding='utf-8').read(), mutation)
        if text is None:
            return 'the original does not stand in the header once', []
        open(header, 'w', encoding='utf-8').write(text)
        alone, mutant = os.path.join(folder, 'alone.cpp'), os.path.join(folder, 'alone.o')
        open(alone, 'w', encoding='utf-8').write(f'#include "globalmatch/{mutation["header"]}"\n')
        if error := compile_object(include, alone, mutant, '-fkeep-inline-functions'):
            return error, []
        for test in mutation['tests']:
            result, cases = built.run(test, folder, [mutant])
            if result == 'failed':
                return 'killed', cases
        # Templates are compiled with the test alone.
        for test in mutation['tests']:
            own = os.path.join(folder, test + '.o')
            if error := compile_object(include, source_of(test), own):
                return error, []
            result, cases = run_objects([built.object['main'], own], folder)
            if result == 'failed':
                return 'killed', cases
        return 'survived', []
    finally:
        shutil.rmtree(folder)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument('--list', default=os.path.join(ROOT, 'tests/mutations/list.txt'))
    parser.add_argument('--jobs', type=int, default=os.cpu_count())
    parser.add_argument('--only', default='', help='entries whose header or tests contain this')
    parser.add_argument('--verbose', action='store_true', help='print what noticed each mutation')
    arguments = parser.parse_args()
    mutations = [m for m in read_list(arguments.list) if arguments.only in m['header'] + ' ' + ' '.join(m['tests'])]
    folder = tempfile.mkdtemp()
    tests = sorted({t for m in mutations for t in m['tests']})

    def attempt(mutation):
        result, cases = try_mutation(mutation, built)
        if arguments.verbose:
            print(f"line {mutation['line']}: {result}: {'; '.join(cases)}", flush=True)
        return result

    with concurrent.futures.ThreadPoolExecutor(arguments.jobs) as pool:
        built = built_tests(folder, tests, pool)
        for test, result in zip(tests, pool.map(lambda t: built.run(t, tempfile.mkdtemp(dir=folder)), tests)):
            if result[0] != 'passed':
                sys.exit(f'{test} does not pass without mutations: {result[1]}')
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


main()
