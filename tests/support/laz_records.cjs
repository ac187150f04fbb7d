// Writes the decoded records of a LAZ or COPC file, in the order of the file, as the packages laz-perf and copc
// decode them: node laz_records.cjs in.laz out.bin
const fs = require('fs');
const { createLazPerf } = require('laz-perf');

function withLazPerf(lazPerf, bytes) {
  const pointer = lazPerf._malloc(bytes.length);
  lazPerf.HEAPU8.set(bytes, pointer);
  const file = new lazPerf.LASZip();
  file.open(pointer, bytes.length);
  const count = file.getCount(), size = file.getPointLength();
  const record = lazPerf._malloc(size);
  const records = Buffer.alloc(count * size);
  for (let i = 0; i < count; ++i) {
    file.getPoint(record);
    records.set(lazPerf.HEAPU8.subarray(record, record + size), i * size);
  }
  return records;
}

async function withCopc(lazPerf, path) {
  const { Copc } = require('copc');
  const copc = await Copc.create(path);
  const pages = [copc.info.rootHierarchyPage], nodes = [];
  while (pages.length > 0) {
    const part = await Copc.loadHierarchyPage(path, pages.pop());
    pages.push(...Object.values(part.pages).filter(Boolean));
    nodes.push(...Object.values(part.nodes).filter((node) => node && node.pointCount > 0));
  }
  nodes.sort((a, b) => a.pointDataOffset - b.pointDataOffset);
  const parts = [];
  for (const node of nodes) parts.push(Buffer.from(await Copc.loadPointDataBuffer(path, copc.header, node, lazPerf)));
  return Buffer.concat(parts);
}

(async () => {
  const [path, out] = process.argv.slice(2);
  const lazPerf = await createLazPerf();
  const bytes = fs.readFileSync(path);
  const isCopc = bytes.toString('latin1', 377, 381) === 'copc';
  fs.writeFileSync(out, isCopc ? await withCopc(lazPerf, path) : withLazPerf(lazPerf, bytes));
})().catch((error) => {
  console.error(String(error));
  process.exit(1);
});
