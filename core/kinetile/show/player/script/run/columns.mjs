// Columns in the form of the page: bytes by significance, deflated, in base64.

const ARRAYS = { f8: Float64Array, u8: BigUint64Array, i4: Int32Array, u1: Uint8Array };

/** Decodes columns: typed arrays, by name. */
export async function decode(coded) {
  const letters = atob(coded.text);
  const packed = new Uint8Array(letters.length);
  for (let at = 0; at < letters.length; at += 1) packed[at] = letters.charCodeAt(at);
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const content = new Uint8Array(await new Response(stream).arrayBuffer());
  const columns = {};
  let at = 0;
  for (const [name, kind, length] of coded.columns) {
    const size = Number(kind[1]);
    const bytes = new Uint8Array(size * length);
    for (let plane = 0; plane < size; plane += 1) {
      for (let row = 0; row < length; row += 1) bytes[row * size + plane] = content[at++];
    }
    columns[name] = new ARRAYS[kind](bytes.buffer);
  }
  return columns;
}
