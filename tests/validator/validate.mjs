// validate.mjs REWRITE MODELS... - every file that Diaphan writes passes the Khronos glTF validator with no error that its input
// did not have. REWRITE is the test's own program, which adds thickness by a formula: what is tested is the file, not the bake. Exit code
// 77: the validator is not installed (npm ci in this folder).
import { execFileSync } from 'node:child_process';
import fs from 'node:fs';
import os from 'node:os';
import path from 'node:path';

let validator;
try {
    validator = (await import('gltf-validator')).default;
} catch {
    console.log('skipped: npm package gltf-validator is missing; run "npm ci" in tests/validator');
    process.exit(77);
}

const [rewrite, ...roots] = process.argv.slice(2);
const folder = fs.mkdtempSync(path.join(os.tmpdir(), 'diaphan-validator-'));

function* models(root) {
    if (!fs.existsSync(root)) {
        console.log(`skipped: ${root} is missing`);
    } else if (fs.statSync(root).isDirectory()) {
        for (const name of fs.readdirSync(root).sort())
            yield* models(path.join(root, name));
    } else if (/\.(glb|gltf|obj|ply|stl)$/i.test(root)) {
        yield root;
    }
}

// The messages of one severity, counted by code. Files that are not there are no fault of ours.
async function messages(file, severity) {
    const report = await validator.validateBytes(new Uint8Array(fs.readFileSync(file)), {
        uri: path.basename(file),
        maxIssues: 0,
        externalResourceFunction: async (uri) => {
            const at = path.join(path.dirname(file), decodeURIComponent(uri));
            return new Uint8Array(fs.readFileSync(at));
        },
    });
    const count = new Map();
    for (const issue of report.issues.messages)
        if (issue.severity === severity && issue.code !== 'IO_ERROR') {
            const seen = count.get(issue.code) ?? { n: 0, first: `${issue.pointer}: ${issue.message}` };
            seen.n++;
            count.set(issue.code, seen);
        }
    return count;
}

let written = 0, refused = 0, failed = 0;

function write(from, to, bands, store) {
    try {
        execFileSync(rewrite, [from, to, bands, store], { stdio: ['ignore', 'ignore', 'pipe'] });
        return true;
    } catch (error) {
        if (error.status !== 3) {
            console.log(`${from}: could not be written: ${error.stderr}`);
            failed++;
        }
        refused++;
        return false;
    }
}

async function check(name, input, output) {
    written++;
    for (const [severity, word] of [[0, 'error'], [1, 'warning']]) {
        const before = /\.gl(b|tf)$/i.test(input) ? await messages(input, severity) : new Map();
        for (const [code, now] of await messages(output, severity)) {
            const was = before.get(code)?.n ?? 0;
            if (now.n <= was)
                continue;
            console.log(`${name}: ${now.n - was} new ${word}(s) ${code}, the first at ${now.first}`);
            failed += severity === 0;
        }
    }
}

// A document in pieces: three buffers of which one is missing, a picture, primitives that share their vertices, extras of every kind.
function makeAwkward(at, missing) {
    const floats = new Float32Array([0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1]);
    const indices = new Uint16Array([0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3]);
    const pixel = 'iVBORw0KGgoAAAANSUhEUgAAAAEAAAABCAYAAAAfFcSJAAAADUlEQVR42mNk+M9QDwADhgGAWjR9awAAAABJRU5ErkJggg==';
    fs.mkdirSync(at);
    fs.writeFileSync(path.join(at, 'a.bin'), Buffer.concat([Buffer.from(floats.buffer), Buffer.from(indices.buffer)]));
    fs.writeFileSync(path.join(at, 'b b.bin'), Buffer.from(floats.buffer));
    fs.writeFileSync(path.join(at, 'p.png'), Buffer.from(pixel, 'base64'));
    const buffers = [{ byteLength: 72, uri: 'a.bin' }, { byteLength: 48, uri: 'b%20b.bin' }];
    if (missing)
        buffers.unshift({ byteLength: 7, uri: 'missing.bin' });
    const first = missing ? 1 : 0;
    const position = { componentType: 5126, count: 4, type: 'VEC3', min: [0, 0, 0], max: [1, 1, 1] };
    const document = {
        asset: { version: '2.0' }, scene: 0, scenes: [{ nodes: [0, 1] }], nodes: [{ mesh: 0 }, { mesh: 0, scale: [1, -2, 1] }],
        meshes: [{ primitives: [
            { attributes: { POSITION: 0 }, indices: 2, material: 0, extras: 'text' },
            { attributes: { POSITION: 0 }, indices: 2, mode: 5 },
            { attributes: { POSITION: 1 }, indices: 2, extras: { diaphan: 3 } }] }],
        materials: [{ pbrMetallicRoughness: { baseColorTexture: { index: 0 } } }], textures: [{ source: 0 }, { source: 1 }],
        images: [{ uri: 'p.png' }, { uri: 'p.png' }],
        accessors: [{ bufferView: 0, ...position }, { bufferView: 1, ...position },
            { bufferView: 2, componentType: 5123, count: 12, type: 'SCALAR' }],
        bufferViews: [{ buffer: first, byteLength: 48, target: 34962 }, { buffer: first + 1, byteLength: 48, target: 34962 },
            { buffer: first, byteOffset: 48, byteLength: 24, target: 34963 }],
        buffers,
    };
    fs.writeFileSync(path.join(at, 'in.gltf'), JSON.stringify(document));
}
makeAwkward(path.join(folder, 'pieces'), false);
makeAwkward(path.join(folder, 'missing'), true);
roots.push(path.join(folder, 'pieces'), path.join(folder, 'missing'));

const stores = [['6', 'snorm8'], ['6', 'cpca'], ['5', 'cpca'], ['5', 'snorm16'], ['8', 'float']];
for (const root of roots)
    for (const model of models(root)) {
        const plain = /\.(obj|ply|stl)$/i.test(model);
        for (const [bands, store] of plain ? stores.slice(0, 2) : stores) {
            const output = path.join(folder, `${bands}${store}.glb`), again = path.join(folder, 'again.glb');
            const name = `${path.basename(model)} ${bands} bands ${store}`;
            if (!write(model, output, bands, store))
                break;
            await check(name, model, output);
            // a second bake on top of the first, with other attributes
            if (!plain && write(output, again, '3', store === 'snorm8' ? 'cpca' : 'snorm8'))
                await check(`${name}, baked again`, model, again);
        }
    }
fs.rmSync(folder, { recursive: true });
console.log(`${written} files checked, ${refused} inputs refused, ${failed} failures`);
process.exit(failed ? 1 : written ? 0 : 77);
