#include "viewer.h"

namespace costate::app {

const char* viewer_script() {
  return R"js(
'use strict';
(function () {
  const box = document.getElementById('viewer'), canvas = document.getElementById('view'),
        slider = document.getElementById('time'), button = document.getElementById('play'),
        label = document.getElementById('label'), layout = document.getElementById('layout');
  const gl = canvas.getContext('webgl', {antialias: true});
  if (!gl) return;  // the drawing stays
  box.hidden = false;
  document.getElementById('still').hidden = true;
  gl.getExtension('OES_element_index_uint');
  const start = Number(box.dataset.start), speed = Number(box.dataset.speed), events = JSON.parse(box.dataset.events);

  // Column-major matrices.
  const multiply = (a, b) => {
    const c = new Float32Array(16);
    for (let i = 0; i < 4; ++i) for (let j = 0; j < 4; ++j) {
      let sum = 0;
      for (let k = 0; k < 4; ++k) sum += a[4 * k + i] * b[4 * j + k];
      c[4 * j + i] = sum;
    }
    return c;
  };
  const placed = (t, q, s) => {
    const [x, y, z, w] = q;
    return new Float32Array([
      s[0] * (1 - 2 * (y * y + z * z)), s[0] * 2 * (x * y + z * w), s[0] * 2 * (x * z - y * w), 0,
      s[1] * 2 * (x * y - z * w), s[1] * (1 - 2 * (x * x + z * z)), s[1] * 2 * (y * z + x * w), 0,
      s[2] * 2 * (x * z + y * w), s[2] * 2 * (y * z - x * w), s[2] * (1 - 2 * (x * x + y * y)), 0,
      t[0], t[1], t[2], 1]);
  };

  const program = gl.createProgram();
  for (const [kind, source] of [
    [gl.VERTEX_SHADER, 'attribute vec3 position, normal; uniform mat4 model, view; uniform vec3 size; varying vec3 n;' +
      'void main() { n = mat3(model) * (normal / (size * size)); gl_Position = view * model * vec4(position, 1.0); }'],
    [gl.FRAGMENT_SHADER, 'precision mediump float; uniform vec4 color; uniform vec3 light; varying vec3 n;' +
      'void main() { float s = 0.45 + 0.55 * abs(dot(normalize(n), light));' +
      'gl_FragColor = vec4(pow(color.rgb * s, vec3(0.4545)) * color.a, color.a); }']]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(program, shader);
  }
  gl.linkProgram(program);
  gl.useProgram(program);
  const uniform = {};
  for (const name of ['model', 'view', 'size', 'color', 'light']) uniform[name] = gl.getUniformLocation(program, name);
  const attribute = {position: gl.getAttribLocation(program, 'position'), normal: gl.getAttribLocation(program, 'normal')};
  gl.enableVertexAttribArray(attribute.position);
  gl.enableVertexAttribArray(attribute.normal);
  gl.enable(gl.DEPTH_TEST);
  gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);

  // One glTF: its solids, and where they are at a time since its start.
  const load = element => {
    const gltf = JSON.parse(element.textContent);
    const bytes = Uint8Array.from(atob(gltf.buffers[0].uri.split(',')[1]), c => c.charCodeAt(0)).buffer;
    const widths = {SCALAR: 1, VEC3: 3, VEC4: 4};
    const numbers = i => {
      const a = gltf.accessors[i], v = gltf.bufferViews[a.bufferView], n = a.count * widths[a.type];
      return a.componentType === 5126 ? new Float32Array(bytes, v.byteOffset, n) : new Uint32Array(bytes, v.byteOffset, n);
    };
    const m = {name: element.dataset.name, times: new Float32Array([0]), nodes: [], moving: []};
    const buffers = {};
    const buffer = (i, target) => {
      if (!buffers[i]) {
        buffers[i] = gl.createBuffer();
        gl.bindBuffer(target, buffers[i]);
        gl.bufferData(target, numbers(i), gl.STATIC_DRAW);
      }
      return buffers[i];
    };
    const channels = {};
    for (const c of gltf.animations ? gltf.animations[0].channels : []) {
      const sampler = gltf.animations[0].samplers[c.sampler];
      m.times = numbers(sampler.input);
      channels[c.target.node + c.target.path] = numbers(sampler.output);
    }
    m.at = (node, path, t) => {
      const all = channels[node + path], n = path === 'rotation' ? 4 : 3;
      if (!all) return gltf.nodes[node][path] || {translation: [0, 0, 0], rotation: [0, 0, 0, 1], scale: [1, 1, 1]}[path];
      let low = 0, high = m.times.length - 1;
      while (high - low > 1) { const middle = (low + high) >> 1; if (m.times[middle] <= t) low = middle; else high = middle; }
      const f = high > low ? Math.min(1, Math.max(0, (t - m.times[low]) / (m.times[high] - m.times[low]))) : 0;
      const r = [];
      for (let k = 0; k < n; ++k) r.push(all[n * low + k] * (1 - f) + all[n * high + k] * f);
      if (n === 4) { const size = Math.hypot(...r); for (let k = 0; k < 4; ++k) r[k] /= size; }  // samples are near each other
      return r;
    };
    m.root = placed([0, 0, 0], gltf.nodes[0].rotation || [0, 0, 0, 1], [1, 1, 1]);
    m.place = (node, t) => {
      const p = m.at(node, 'translation', t);
      return [0, 1, 2].map(k => m.root[k] * p[0] + m.root[4 + k] * p[1] + m.root[8 + k] * p[2]);
    };
    for (let node = 1; node < gltf.nodes.length; ++node) {
      m.nodes.push(node);
      if (channels[node + 'translation']) m.moving.push(node);
    }
    m.middle = t => {
      const sum = [0, 0, 0];
      for (const node of m.moving) m.place(node, t).forEach((x, k) => { sum[k] += x / m.moving.length; });
      return sum;
    };
    m.draw = (t, clear, ghost) => {
      for (const node of m.nodes) {
        const p = gltf.meshes[gltf.nodes[node].mesh].primitives[0];
        let color = gltf.materials[p.material].pbrMetallicRoughness.baseColorFactor;
        if (ghost) color = [0.77, 0.37, 0.11, 0.4 * color[3]];
        if (clear !== color[3] < 1) continue;
        const size = m.at(node, 'scale', t);
        gl.uniformMatrix4fv(uniform.model, false,
                            multiply(m.root, placed(m.at(node, 'translation', t), m.at(node, 'rotation', t), size)));
        gl.uniform3fv(uniform.size, size);
        gl.uniform4fv(uniform.color, color);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer(p.attributes.POSITION, gl.ARRAY_BUFFER));
        gl.vertexAttribPointer(attribute.position, 3, gl.FLOAT, false, 0, 0);
        gl.bindBuffer(gl.ARRAY_BUFFER, buffer(p.attributes.NORMAL, gl.ARRAY_BUFFER));
        gl.vertexAttribPointer(attribute.normal, 3, gl.FLOAT, false, 0, 0);
        gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffer(p.indices, gl.ELEMENT_ARRAY_BUFFER));
        gl.drawElements(gl.TRIANGLES, gltf.accessors[p.indices].count, gl.UNSIGNED_INT, 0);
      }
    };
    return m;
  };
  const motions = Array.from(document.querySelectorAll('script.gltf'), load), shown = motions[motions.length - 1];
  const end = Math.max(...motions.map(m => m.times[m.times.length - 1]));
)js"
         R"js(
  // The room that the motions take, for the camera. What travels far is followed.
  const room = some => {
    const low = [1e30, 1e30, 1e30], high = [-1e30, -1e30, -1e30];
    for (const m of motions)
      for (const node of m.nodes)
        for (const t of some(m))
          m.place(node, t).forEach((x, k) => { low[k] = Math.min(low[k], x); high[k] = Math.max(high[k], x); });
    return {low, high, extent: Math.max(...high.map((x, k) => x - low[k]), 1e-3)};
  };
  const all = room(m => m.times.filter((t, i) => i % Math.max(1, m.times.length >> 4) === 0)), first = room(m => [m.times[0]]);
  const follows = shown.moving.length > 0 && all.extent > 3 * first.extent;
  const {low, high, extent} = follows ? first : all;
  const target = low.map((x, k) => (x + high[k]) / 2);
  const flat = all.high[2] - all.low[2] < 1e-6 * all.extent;
  let turn = flat ? 0 : 0.7, tilt = flat ? 0 : 0.4, distance = 1.9 * extent;

  let t = 0, playing = true, last = 0;
  const camera = (m, aspect) => {
    const near = distance / 50, far = distance * 20, f = 1.8;
    const c = Math.cos(turn), s = Math.sin(turn), e = Math.cos(tilt), d = Math.sin(tilt);
    const right = [c, 0, -s], up = [-s * d, e, -c * d], back = [s * e, d, c * e];
    const from = m.middle(m.times[0]), here = follows ? m.middle(t) : from;
    const eye = target.map((x, k) => x + here[k] - from[k] + distance * back[k]);
    const dot = v => -(v[0] * eye[0] + v[1] * eye[1] + v[2] * eye[2]);
    const view = [right[0], up[0], back[0], 0, right[1], up[1], back[1], 0, right[2], up[2], back[2], 0, dot(right), dot(up), dot(back), 1];
    const lens = [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / (near - far), -1, 0, 0, 2 * far * near / (near - far), 0];
    gl.uniform3fv(uniform.light, back.map((x, k) => 0.8 * x + 0.5 * up[k] + 0.33 * right[k]));
    return multiply(lens, view);
  };

  const draw = () => {
    const wide = Math.round(canvas.clientWidth * devicePixelRatio), tall = Math.round(canvas.clientHeight * devicePixelRatio);
    if (canvas.width !== wide || canvas.height !== tall) { canvas.width = wide; canvas.height = tall; }
    gl.clearColor(1, 1, 1, 1);
    gl.depthMask(true);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const choice = layout ? layout.value : 'over', beside = choice === 'beside';
    const drawn = motions.filter(m => choice === 'over' || beside || m.name === choice);
    for (const clear of [false, true]) {  // what can be looked through comes last
      (clear ? gl.enable : gl.disable).call(gl, gl.BLEND);
      gl.depthMask(!clear);
      drawn.forEach((m, i) => {
        const width = beside ? Math.floor(wide / drawn.length) : wide;
        gl.viewport(beside ? i * width : 0, 0, width, tall);
        gl.uniformMatrix4fv(uniform.view, false, camera(choice === 'over' ? shown : m, width / Math.max(1, tall)));
        m.draw(t, clear, choice === 'over' && m !== shown);
      });
    }
    const now = start + t, passed = events.filter(e => e.t <= now).pop();
    label.textContent = 't = ' + now.toPrecision(4) + ' s' + (passed ? ', ' + passed.name + ' at ' + passed.t.toPrecision(4) + ' s' : '');
    document.dispatchEvent(new CustomEvent('costate-time', {detail: now}));
  };
  const play = on => { playing = on; button.textContent = on ? 'Pause' : 'Play'; };
  const seek = to => { play(false); t = Math.min(end, Math.max(0, to)); slider.value = t; draw(); };
  slider.max = end;
  slider.step = end / 1000 || 1;
  slider.oninput = () => seek(Number(slider.value));
  document.addEventListener('costate-seek', e => seek(e.detail - start));
  button.onclick = () => play(!playing);
  if (layout) layout.onchange = draw;
  canvas.onpointerdown = e => canvas.setPointerCapture(e.pointerId);
  canvas.onpointermove = e => {
    if (!e.buttons) return;
    if (e.shiftKey || e.buttons === 2) {
      const k = distance / canvas.clientHeight;
      target[0] -= k * e.movementX * Math.cos(turn);
      target[2] += k * e.movementX * Math.sin(turn);
      target[1] += k * e.movementY;
    } else {
      turn -= e.movementX / 150;
      tilt = Math.min(1.55, Math.max(-1.55, tilt + e.movementY / 150));
    }
    draw();
  };
  canvas.oncontextmenu = e => e.preventDefault();
  canvas.onwheel = e => {  // on a page longer than the window the wheel is the page's until the view has been clicked
    const long = document.documentElement.scrollHeight > innerHeight + 1;
    if (long && document.activeElement !== canvas && !e.ctrlKey) return;
    e.preventDefault();
    distance *= Math.exp(e.deltaY / 800);
    draw();
  };
  addEventListener('resize', draw);
  const marks = document.getElementById('marks');  // the slider's button is some 16 pixels wide
  for (const e of events) {
    const mark = document.createElement('span');
    mark.style.left = 'calc(8px + (100% - 16px) * ' + Math.min(1, Math.max(0, (e.t - start) / (end || 1))) + ')';
    mark.title = 't = ' + e.t.toPrecision(6) + ' s: ' + e.name;
    mark.onclick = () => seek(e.t - start);
    marks.append(mark);
  }
  const frame = now => {
    if (playing && end > 0) {
      t = (t + speed * Math.min(0.1, (now - last) / 1000)) % end;
      slider.value = t;
      draw();
    }
    last = now;
    requestAnimationFrame(frame);
  };
  draw();
  document.body.dataset.drawn = motions.reduce((sum, m) => sum + m.nodes.length, 0);
  requestAnimationFrame(frame);
})();
)js";
}

}  // namespace costate::app
