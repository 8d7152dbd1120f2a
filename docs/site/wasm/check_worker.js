// Runs check_paths in a worker, behind the glue that em++ makes, while the page reads the file. Messages are { file },
// then any number of { block }, at last { end } or, where the page cannot read on, { broken }. Answers are
// { read: bytes, buffer } to each block, whose buffer is given back, and at last { status, report, complaint, found,
// memory } or, where the program itself fails, { failure }.
const report = [], complaint = [];
const no_bytes = new Uint8Array();
let file = null;
let block = no_bytes, start_of_block = 0; // the part of the file that is here

// What the program does at a block's end: it waits, or stops, or, looking for its examples, reads for itself.
const again = 6, io_error = 29; // numbers of errors
const at_end = {
    wait: (_, { ErrnoError }) => { throw new ErrnoError(again); },
    stop: () => {},
    fail: (_, { ErrnoError }) => { throw new ErrnoError(io_error); },
    read(position, FS) {
        try {
            block = new Uint8Array(new FileReaderSync().readAsArrayBuffer(file.slice(position, position + (1 << 20))));
        } catch {
            at_end.fail(position, FS);
        }
        start_of_block = position;
    },
};
let at_end_of_block = at_end.wait;

const loaded = check_paths({ print: (line) => report.push(line), printErr: (line) => complaint.push(line) }).then((program) => {
    const { FS } = program;
    const read = (stream, buffer, offset, length, position) => {
        if (position >= start_of_block + block.length) at_end_of_block(position, FS);
        const bytes = block.subarray(position - start_of_block, position - start_of_block + length);
        buffer.set(bytes, offset);
        return bytes.length;
    };
    const device = FS.makedev(64, 0);
    FS.registerDevice(device, { read });
    FS.mkdev("/dropped", device);
    return program;
});

let is_done = false;
function take(program, data) {
    const call = (name, ...words) => program.ccall(name, "number", words.map(() => "string"), words);
    if (is_done) return;
    if (data.file) {
        file = data.file;
        call("begin");
        return;
    }
    if (data.block) block = data.block;
    else at_end_of_block = data.end ? at_end.stop : at_end.fail;
    if (call("go_on")) { // all of the block has been read
        start_of_block += block.length;
        const { buffer } = block;
        block = no_bytes;
        postMessage({ read: start_of_block, buffer }, [buffer]);
        return;
    }
    is_done = true;
    at_end_of_block = at_end.read;
    [block, start_of_block] = [no_bytes, 0];
    const status = call("finish", file.name);
    const text = (lines) => lines.map((line) => line + "\n").join("");
    const found = JSON.parse(program.ccall("suspects", "string", [], []));
    postMessage({ status, report: text(report), complaint: text(complaint), found, memory: program.HEAPU8.length });
}
onmessage = ({ data }) => loaded.then((program) => take(program, data)).catch((error) => postMessage({ failure: `${error}` }));
