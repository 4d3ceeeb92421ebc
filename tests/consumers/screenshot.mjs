// Usage: node screenshot.mjs X,Y,Z MODEL PNG [MODEL PNG]...
//
// Takes pictures of glTF and GLB files as three.js shows them in headless Chromium, seen from
// the direction X,Y,Z with the Y axis up (Z where that is the direction). Prints, as JSON, what
// the page has logged. The packages are in the folder $FAM_CONSUMERS.

import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { createRequire } from 'node:module';
import { basename, dirname, join, normalize } from 'node:path';

const require = createRequire(join(process.env.FAM_CONSUMERS, 'package.json'));
const { chromium } = require('playwright-core');

const SIZE = 512;
const [direction, ...files] = process.argv.slice(2);
const models = files.filter((_, at) => at % 2 === 0);
const pictures = files.filter((_, at) => at % 2 === 1);

async function content(path) {
  const model = path.match(/^\/models\/(\d+)\/([^/]+)$/);
  if (model) {
    const file = join(dirname(models[model[1]]), decodeURIComponent(model[2]));
    return ['application/octet-stream', await readFile(file)];
  }
  if (path === '/') {
    return ['text/html', await readFile(new URL('viewer.html', import.meta.url))];
  }
  const inside = normalize(path).replace(/^\/three\//, '');
  const script = join(process.env.FAM_CONSUMERS, 'node_modules/three', inside);
  return ['text/javascript', await readFile(script)];
}

const server = createServer(async (request, response) => {
  try {
    const [type, body] = await content(new URL(request.url, 'http://127.0.0.1').pathname);
    response.writeHead(200, { 'Content-Type': type }).end(body);
  } catch {
    response.writeHead(404).end();
  }
});
await new Promise((ready) => server.listen(0, '127.0.0.1', ready));
const browser = await chromium.launch({
  executablePath: '/usr/bin/chromium',
  args: [
    '--no-sandbox',
    '--use-gl=angle',
    '--use-angle=swiftshader',
    '--enable-unsafe-swiftshader',
    '--disable-background-networking',
    '--disable-component-update',
    '--disable-quic',
    '--disable-sync',
    '--no-first-run',
  ],
});
try {
  const page = await browser.newPage({ viewport: { width: SIZE, height: SIZE } });
  const log = [];
  page.on('console', (message) => log.push(`${message.type()}: ${message.text()}`));
  page.on('pageerror', (error) => log.push(`error: ${error.message}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/`);
  await page.waitForFunction(() => 'show' in window);
  for (const [at, picture] of pictures.entries()) {
    await page.evaluate(
      ([url, from]) => window.show(url, from),
      [`/models/${at}/${encodeURIComponent(basename(models[at]))}`, direction.split(',').map(Number)],
    );
    await page.screenshot({ path: picture });
  }
  process.stdout.write(JSON.stringify(log));
} finally {
  await browser.close();
  server.close();
}
