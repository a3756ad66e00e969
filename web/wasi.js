"use strict";

/* A system for programs in WebAssembly: WASI preview 1, with files in memory, without a network and without processes.
 * https://github.com/WebAssembly/WASI/blob/wasi-0.1/preview1/docs.md */

const Wasi = (() => {
  const ERROR = { BADF: 8, EXIST: 20, INVAL: 28, ISDIR: 31, NOENT: 44, NOSYS: 52, NOTDIR: 54, NOTEMPTY: 55 };
  const TYPE = { STREAM: 2, FOLDER: 3, FILE: 4 };
  const ROOT = 3;

  class Failure extends Error {
    constructor(name) {
      super(name);
      this.code = ERROR[name];
    }
  }

  class Exit extends Error {
    constructor(code) {
      super(`exit status ${code}`);
      this.code = code;
    }
  }

  let inodes = 0n;
  const folder = () => ({ inode: ++inodes, entries: new Map() });
  const file = (bytes) => ({ inode: ++inodes, bytes, size: bytes.length });
  const type = (node) => (node.entries ? TYPE.FOLDER : TYPE.FILE);

  /* Makes room for so many bytes, in ever larger steps. */
  const grow = (node, size) => {
    if (size > node.bytes.length) {
      const bytes = new Uint8Array(Math.max(size, 2 * node.bytes.length, 1024));
      bytes.set(node.bytes.subarray(0, node.size));
      node.bytes = bytes;
    } else if (size > node.size) node.bytes.fill(0, node.size, size);
    node.size = Math.max(node.size, size);
  };

  /* Files in memory. Names are separated by slashes. */
  class Files {
    constructor() {
      this.root = folder();
    }

    /* The folder of a path, the name in it, and what it names. */
    place(path, from = []) {
      const parts = [];
      for (const part of [...from, ...path.split("/")]) {
        if (part === "..") parts.pop();
        else if (part && part !== ".") parts.push(part);
      }
      const name = parts.pop();
      let parent = this.root;
      if (name === undefined) return { parent, name, node: parent, parts: [] };
      for (const part of parts) {
        parent = parent.entries.get(part);
        if (!parent) throw new Failure("NOENT");
        if (!parent.entries) throw new Failure("NOTDIR");
      }
      return { parent, name, node: parent.entries.get(name), parts: [...parts, name] };
    }

    /* Writes a file, and the folders that it lies in. */
    write(path, bytes) {
      let parent = this.root;
      const parts = path.split("/").filter(Boolean);
      const name = parts.pop();
      for (const part of parts) {
        if (!parent.entries.get(part)?.entries) parent.entries.set(part, folder());
        parent = parent.entries.get(part);
      }
      parent.entries.set(name, file(bytes));
    }

    /* The bytes of a file; null if there is none. */
    read(path) {
      try {
        const { node } = this.place(path);
        return node?.bytes ? node.bytes.subarray(0, node.size) : null;
      } catch {
        return null;
      }
    }

    remove(path) {
      const { parent, name } = this.place(path);
      parent.entries.delete(name);
    }
  }

  /* A run of a program: arguments, environment, the bytes of its input, and functions that take its output. */
  class Run {
    constructor(files, { args, env = {}, input = new Uint8Array(), output = () => {}, error = () => {} }) {
      Object.assign(this, { files, args, env, output, error });
      const bytes = (text) => new TextEncoder().encode(`${text}\0`);
      this.argBytes = args.map(bytes);
      this.envBytes = Object.entries(env).map(([name, value]) => bytes(`${name}=${value}`));
      this.open = new Map([
        [0, { stream: true, node: file(input), at: 0 }],
        [1, { stream: true, take: (bytes) => this.output(bytes) }],
        [2, { stream: true, take: (bytes) => this.error(bytes) }],
        [ROOT, { node: files.root, parts: [] }],
      ]);
      this.next = ROOT + 1;
    }

    /* Gives the program further input. */
    give(input) {
      const handle = this.open.get(0);
      handle.node = file(input);
      handle.at = 0;
    }

    get view() {
      return new DataView(this.memory.buffer);
    }

    bytes(at, length) {
      return new Uint8Array(this.memory.buffer, at, length);
    }

    text(at, length) {
      return new TextDecoder().decode(this.bytes(at, length));
    }

    handle(fd) {
      const handle = this.open.get(fd);
      if (!handle) throw new Failure("BADF");
      return handle;
    }

    place(fd, at, length) {
      const { parts } = this.handle(fd);
      if (!parts) throw new Failure("NOTDIR");
      return this.files.place(this.text(at, length), parts);
    }

    found(fd, at, length) {
      const place = this.place(fd, at, length);
      if (!place.node) throw new Failure("NOENT");
      return place;
    }

    /* The parts of a list of buffers. */
    *buffers(at, count) {
      for (let i = 0; i < count; i++) {
        const { view } = this;
        yield this.bytes(view.getUint32(at + 8 * i, true), view.getUint32(at + 8 * i + 4, true));
      }
    }

    list(at, buffer, items) {
      for (const [i, item] of items.entries()) {
        this.view.setUint32(at + 4 * i, buffer, true);
        this.bytes(buffer, item.length).set(item);
        buffer += item.length;
      }
    }

    sizes(count, size, items) {
      this.view.setUint32(count, items.length, true);
      this.view.setUint32(size, items.reduce((sum, item) => sum + item.length, 0), true);
    }

    stat(at, node, isStream) {
      const { view } = this;
      this.bytes(at, 64).fill(0);
      view.setBigUint64(at + 8, node?.inode ?? 0n, true);
      view.setUint8(at + 16, isStream ? TYPE.STREAM : type(node));
      view.setBigUint64(at + 24, 1n, true);
      view.setBigUint64(at + 32, BigInt(node?.size ?? 0), true);
    }

    transfer(fd, at, count, out, act, start) {
      const handle = this.handle(fd);
      if (handle.node?.entries) throw new Failure("ISDIR");
      let place = start ?? handle.at;
      let sum = 0;
      for (const buffer of this.buffers(at, count)) {
        const done = act(handle, buffer, place);
        place += done;
        sum += done;
        if (done < buffer.length) break;
      }
      if (start === undefined) handle.at = place;
      this.view.setUint32(out, sum, true);
    }

    static read({ node }, buffer, at) {
      const part = node.bytes.subarray(Math.min(at, node.size), Math.min(at + buffer.length, node.size));
      buffer.set(part);
      return part.length;
    }

    static write({ node, take }, buffer, at) {
      if (take) take(buffer.slice());
      else {
        grow(node, at + buffer.length);
        node.bytes.set(buffer, at);
      }
      return buffer.length;
    }

    calls() {
      return {
        args_sizes_get: (count, size) => this.sizes(count, size, this.argBytes),
        args_get: (at, buffer) => this.list(at, buffer, this.argBytes),
        environ_sizes_get: (count, size) => this.sizes(count, size, this.envBytes),
        environ_get: (at, buffer) => this.list(at, buffer, this.envBytes),
        clock_res_get: (_, out) => this.view.setBigUint64(out, 1000n, true),
        clock_time_get: (clock, _, out) => {
          const milliseconds = clock === 0 ? Date.now() : performance.now();
          this.view.setBigUint64(out, BigInt(Math.round(milliseconds * 1e6)), true);
        },
        random_get: (at, length) => {
          for (let done = 0; done < length; done += 65536) {
            crypto.getRandomValues(this.bytes(at + done, Math.min(65536, length - done)));
          }
        },
        proc_exit: (code) => {
          throw new Exit(code);
        },
        sched_yield: () => {},
        /* A wait ends at once: nothing else runs meanwhile. */
        poll_oneoff: (subscriptions, events, count, out) => {
          this.bytes(events, 32 * count).fill(0);
          for (let i = 0; i < count; i++) {
            const { view } = this;
            view.setBigUint64(events + 32 * i, view.getBigUint64(subscriptions + 48 * i, true), true);
            view.setUint8(events + 32 * i + 10, view.getUint8(subscriptions + 48 * i + 8));
          }
          this.view.setUint32(out, count, true);
        },
        fd_prestat_get: (fd, out) => {
          if (fd !== ROOT) throw new Failure("BADF");
          this.view.setUint32(out, 0, true);
          this.view.setUint32(out + 4, 1, true);
        },
        fd_prestat_dir_name: (_, at) => this.view.setUint8(at, "/".charCodeAt(0)),
        fd_fdstat_get: (fd, out) => {
          const { stream, node, append } = this.handle(fd);
          this.bytes(out, 24).fill(0);
          this.view.setUint8(out, stream ? TYPE.STREAM : type(node));
          this.view.setUint16(out + 2, append ? 1 : 0, true);
          this.view.setBigUint64(out + 8, 0x1fffffffn, true);
          this.view.setBigUint64(out + 16, 0x1fffffffn, true);
        },
        fd_fdstat_set_flags: (fd, flags) => {
          this.handle(fd).append = (flags & 1) !== 0;
        },
        fd_filestat_get: (fd, out) => {
          const { stream, node } = this.handle(fd);
          this.stat(out, node, stream);
        },
        fd_filestat_set_size: (fd, size) => {
          const { node } = this.handle(fd);
          grow(node, Number(size));
          node.size = Number(size);
        },
        fd_filestat_set_times: () => {},
        fd_allocate: () => {},
        fd_advise: () => {},
        fd_sync: () => {},
        fd_datasync: () => {},
        fd_close: (fd) => {
          this.handle(fd);
          this.open.delete(fd);
        },
        fd_renumber: (from, to) => {
          this.open.set(to, this.handle(from));
          this.open.delete(from);
        },
        fd_seek: (fd, offset, whence, out) => {
          const handle = this.handle(fd);
          if (handle.stream) throw new Failure("INVAL");
          const base = [0, handle.at, handle.node.size][whence];
          handle.at = base + Number(offset);
          this.view.setBigUint64(out, BigInt(handle.at), true);
        },
        fd_tell: (fd, out) => this.view.setBigUint64(out, BigInt(this.handle(fd).at), true),
        fd_read: (fd, at, count, out) => this.transfer(fd, at, count, out, Run.read),
        fd_pread: (fd, at, count, offset, out) => this.transfer(fd, at, count, out, Run.read, Number(offset)),
        fd_write: (fd, at, count, out) => {
          const handle = this.handle(fd);
          if (handle.append) handle.at = handle.node.size;
          this.transfer(fd, at, count, out, Run.write);
        },
        fd_pwrite: (fd, at, count, offset, out) => this.transfer(fd, at, count, out, Run.write, Number(offset)),
        fd_readdir: (fd, at, length, cookie, out) => {
          const { node } = this.handle(fd);
          if (!node?.entries) throw new Failure("NOTDIR");
          let used = 0;
          for (const [i, [name, entry]] of [...node.entries].entries()) {
            if (i < Number(cookie) || used === length) continue;
            const bytes = new TextEncoder().encode(name);
            const record = new Uint8Array(24 + bytes.length);
            const view = new DataView(record.buffer);
            view.setBigUint64(0, BigInt(i + 1), true);
            view.setBigUint64(8, entry.inode, true);
            view.setUint32(16, bytes.length, true);
            view.setUint8(20, type(entry));
            record.set(bytes, 24);
            const part = record.subarray(0, length - used);
            this.bytes(at + used, part.length).set(part);
            used += part.length;
          }
          this.view.setUint32(out, used, true);
        },
        path_open: (fd, _follow, at, length, flags, _rights, _inherited, state, out) => {
          const { parent, name, node, parts } = this.place(fd, at, length);
          const [creates, isFolder, isNew, empties] = [1, 2, 4, 8].map((bit) => (flags & bit) !== 0);
          let opened = node;
          if (!node) {
            if (!creates) throw new Failure("NOENT");
            opened = file(new Uint8Array());
            parent.entries.set(name, opened);
          } else if (isNew) throw new Failure("EXIST");
          else if (isFolder && !node.entries) throw new Failure("NOTDIR");
          else if (empties && node.entries) throw new Failure("ISDIR");
          else if (empties) node.size = 0;
          this.open.set(this.next, { node: opened, at: 0, parts: opened.entries && parts, append: (state & 1) !== 0 });
          this.view.setUint32(out, this.next++, true);
        },
        path_create_directory: (fd, at, length) => {
          const { parent, name, node } = this.place(fd, at, length);
          if (node) throw new Failure("EXIST");
          parent.entries.set(name, folder());
        },
        path_filestat_get: (fd, _follow, at, length, out) => this.stat(out, this.found(fd, at, length).node, false),
        path_filestat_set_times: () => {},
        path_link: (from, _follow, at, length, to, place, size) => {
          const { node } = this.found(from, at, length);
          const target = this.place(to, place, size);
          if (target.node) throw new Failure("EXIST");
          target.parent.entries.set(target.name, node);
        },
        path_readlink: () => {
          throw new Failure("INVAL");
        },
        path_symlink: () => {
          throw new Failure("NOSYS");
        },
        path_remove_directory: (fd, at, length) => {
          const { parent, name, node } = this.found(fd, at, length);
          if (!node.entries) throw new Failure("NOTDIR");
          if (node.entries.size) throw new Failure("NOTEMPTY");
          parent.entries.delete(name);
        },
        path_unlink_file: (fd, at, length) => {
          const { parent, name, node } = this.found(fd, at, length);
          if (node.entries) throw new Failure("ISDIR");
          parent.entries.delete(name);
        },
        path_rename: (from, at, length, to, place, size) => {
          const { parent, name, node } = this.found(from, at, length);
          const target = this.place(to, place, size);
          if (target.node?.entries?.size) throw new Failure("NOTEMPTY");
          parent.entries.delete(name);
          target.parent.entries.set(target.name, node);
        },
      };
    }

    /* The functions that a module imports; those that are missing here fail as not implemented. */
    imports(module) {
      const calls = this.calls();
      const guarded = {};
      for (const { name } of WebAssembly.Module.imports(module)) {
        const call = calls[name];
        guarded[name] = (...values) => {
          if (!call) return ERROR.NOSYS;
          try {
            call(...values);
            return 0;
          } catch (error) {
            if (error instanceof Failure) return error.code;
            throw error;
          }
        };
      }
      return { wasi_snapshot_preview1: guarded };
    }

    instantiate(module) {
      const instance = new WebAssembly.Instance(module, this.imports(module));
      this.memory = instance.exports.memory;
      return instance.exports;
    }

    /* Runs the program to its end; yields its exit status. */
    start(module) {
      try {
        this.instantiate(module)._start();
        return 0;
      } catch (error) {
        if (error instanceof Exit) return error.code;
        throw error;
      }
    }
  }

  return { Files, Run, Exit };
})();

if (typeof module !== "undefined") module.exports = Wasi;
