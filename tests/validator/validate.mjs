// validate.mjs REWRITE MODELS... - every file that Diaphan writes passes the Khronos glTF validator with no error that its input
// did not have. REWRITE is the test's own program; with the word "bake" behind a path it is the tool. Exit code 77: the validator is not
// installed (npm ci in this folder).
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

const stores = [['6', 'snorm8'], ['5', 'snorm16'], ['8', 'float']];
for (const root of roots)
    for (const model of models(root)) {
        const plain = /\.(obj|ply|stl)$/i.test(model);
        for (const [bands, store] of plain ? stores.slice(0, 1) : stores) {
            const output = path.join(folder, `${bands}.glb`), again = path.join(folder, 'again.glb');
            const name = `${path.basename(model)} ${bands} bands ${store}`;
            if (!write(model, output, bands, store))
                break;
            await check(name, model, output);
            // a second bake on top of the first, with other attributes
            if (!plain && write(output, again, '3', 'snorm8'))
                await check(`${name}, baked again`, model, again);
        }
    }
fs.rmSync(folder, { recursive: true });
console.log(`${written} files checked, ${refused} inputs refused, ${failed} failures`);
process.exit(failed ? 1 : written ? 0 : 77);
