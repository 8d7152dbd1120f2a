// Runs check_paths in a worker, behind the glue that em++ makes: reads the file piece by piece, as the native program
// does. A message is the file; answers are { read: bytes }, and one { status, report, complaint, found, ... }.
onmessage = async ({ data: file }) => {
    const lines = { report: [], complaint: [] };
    const program = await check_paths({
        print: (line) => lines.report.push(line),
        printErr: (line) => lines.complaint.push(line),
    });
    const { FS, WORKERFS } = program;
    // In large blocks: each costs a round trip to the process that may read files.
    const reader = new FileReaderSync(), block_size = 16 << 20;
    let block = new Uint8Array(), start_of_block = 0;
    WORKERFS.stream_ops.read = (stream, buffer, offset, length, position) => {
        if (position >= file.size) return 0;
        if (position < start_of_block || position >= start_of_block + block.length) {
            try {
                block = new Uint8Array(reader.readAsArrayBuffer(file.slice(position, position + block_size)));
            } catch {
                const io_error = 29;
                throw new FS.ErrnoError(io_error); // a folder, or a file that has changed meanwhile
            }
            start_of_block = position;
            postMessage({ read: position });
        }
        const bytes = block.subarray(position - start_of_block, position - start_of_block + length);
        buffer.set(bytes, offset);
        return bytes.length;
    };
    FS.mkdir("/dropped");
    FS.mount(WORKERFS, { files: [file] }, "/dropped");
    FS.chdir("/dropped");
    const start = performance.now();
    const name = file.name === "-" ? "./-" : file.name; // not standard input
    const status = program.ccall("check", "number", ["string"], [name]);
    const seconds = (performance.now() - start) / 1000;
    const text = (of) => of.map((line) => line + "\n").join("");
    postMessage({
        status,
        report: text(lines.report),
        complaint: text(lines.complaint),
        found: JSON.parse(program.ccall("suspects", "string", [], [])),
        seconds,
        memory: program.HEAPU8.length,
    });
};
