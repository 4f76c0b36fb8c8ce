#include "viewer.h"

namespace costate::app {

const char* viewer_script() {
  return R"js(
'use strict';
(function () {
  const part = id => document.getElementById(id);
  const box = part('viewer'), canvas = part('view'), slider = part('time'), button = part('play'), layout = part('layout');
  const context = canvas.getContext('webgl', {alpha: false, antialias: true});
  if (!context) return;  // the drawing stays
  box.hidden = false;
  part('still').hidden = true;
  const start = Number(box.dataset.start), speed = Number(box.dataset.speed), events = JSON.parse(box.dataset.events);

  // One glTF: a group of its solids, where they are at a time since its start, and their colours, its own or a ghost's.
  const load = element => {
    const gltf = JSON.parse(element.textContent), animation = (gltf.animations || [])[0] || {channels: []};
    const bytes = Uint8Array.from(atob(gltf.buffers[0].uri.split(',')[1]), c => c.charCodeAt(0)).buffer;
    const widths = {SCALAR: 1, VEC3: 3, VEC4: 4}, keys = {translation: 'position', rotation: 'quaternion', scale: 'scale'};
    const data = gltf.accessors.map(a => {
      const Numbers = a.componentType === 5126 ? Float32Array : Uint32Array, n = widths[a.type];
      return new THREE.BufferAttribute(new Numbers(bytes, gltf.bufferViews[a.bufferView].byteOffset, a.count * n), n);
    });
    const materials = gltf.materials.map(m => new THREE.MeshStandardMaterial({
      side: THREE.DoubleSide, depthFunc: THREE.LessDepth, metalness: 0, roughness: m.pbrMetallicRoughness.roughnessFactor}));
    const meshes = gltf.meshes.map(({primitives: [p]}) => {
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute('position', data[p.attributes.POSITION]).setAttribute('normal', data[p.attributes.NORMAL]);
      geometry.setIndex(data[p.indices]);
      return new THREE.Mesh(geometry, materials[p.material]);
    });
    const m = {name: element.dataset.name, group: new THREE.Group(), times: [0]};
    m.group.quaternion.fromArray(gltf.nodes[0].rotation || [0, 0, 0, 1]);
    const solids = m.solids = gltf.nodes.slice(1).map(node => {
      const solid = meshes[node.mesh].clone();
      for (const path in keys) solid[keys[path]].fromArray(node[path]);
      m.group.add(solid);
      return solid;
    });
    const moving = [], tracks = animation.channels.map(({target, sampler}) => {
      const Track = target.path === 'rotation' ? THREE.QuaternionKeyframeTrack : THREE.VectorKeyframeTrack;
      const {input, output} = animation.samplers[sampler], solid = solids[target.node - 1];
      m.times = data[input].array;
      if (target.path === 'translation') moving.push(solid);
      return [solid[keys[target.path]], new Track(target.path, m.times, data[output].array).createInterpolant()];
    });
    m.pose = t => { for (const [value, samples] of tracks) value.fromArray(samples.evaluate(t)); };
    m.place = solid => solid.position.clone().applyQuaternion(m.group.quaternion);
    m.middle = () => moving.reduce((sum, s) => sum.addScaledVector(m.place(s), 1 / moving.length), new THREE.Vector3());
    m.first = m.middle();
    m.moves = moving.length > 0;
    m.dress = ghost => materials.forEach((material, i) => {
      const [r, g, b, clear] = gltf.materials[i].pbrMetallicRoughness.baseColorFactor, opacity = ghost ? 0.4 * clear : clear;
      material.color.setRGB(...(ghost ? [0.77, 0.37, 0.11] : [r, g, b]));
      Object.assign(material, {opacity, transparent: opacity < 1, depthWrite: opacity === 1});
    });
    return m;
  };
  const motions = Array.from(document.querySelectorAll('script.gltf'), load), shown = motions[motions.length - 1];
  const end = Math.max(...motions.map(m => m.times[m.times.length - 1]));

  // The room that the motions take is shown as of size 1 about the origin: to the controls a step below 1e-3 is none.
  // What travels far is followed.
  const room = some => {
    const all = new THREE.Box3();
    for (const m of motions)
      for (const t of some(m.times)) {
        m.pose(t);
        for (const solid of m.solids) all.expandByPoint(m.place(solid));
      }
    return all;
  };
  const size = room => Math.max(...room.getSize(new THREE.Vector3()).toArray(), 1e-3);
  const all = room(times => times.filter((t, i) => i % Math.max(1, times.length >> 4) === 0));
  const first = room(times => times.slice(0, 1));
  const follows = shown.moves && size(all) > 3 * size(first), near = follows ? first : all;
  const middle = near.getCenter(new THREE.Vector3()), scale = 1 / size(near), flat = all.max.z - all.min.z < 1e-6 * size(all);

  const renderer = new THREE.WebGLRenderer({canvas, context});
  renderer.gammaOutput = true;  // colours of glTF are linear
  renderer.gammaFactor = 2.2;
  renderer.setClearColor(0xffffff);
  renderer.setScissorTest(true);
  const scene = new THREE.Scene(), camera = new THREE.PerspectiveCamera(58), lamp = new THREE.DirectionalLight(0xffffff, 0.6);
  lamp.position.set(0.33, 0.5, 0.8);
  lamp.target = camera;
  camera.add(lamp);
  scene.add(camera, new THREE.HemisphereLight(0xffffff, 0x999999, 0.5), ...motions.map(m => m.group));
  camera.position.setFromSphericalCoords(1.9, Math.PI / 2 - (flat ? 0 : 0.4), flat ? 0 : 0.7);

  let t = 0, playing = true, last = 0;  // [s], and [ms] of the page
  const draw = () => {
    const choice = layout ? layout.value : 'over', alone = motions.filter(m => m.name === choice);
    const views = choice === 'beside' ? motions.map(m => [m]) : [choice === 'over' ? motions : alone];
    const width = canvas.clientWidth / views.length, tall = canvas.clientHeight;
    const distance = camera.position.distanceTo(controls.target);
    Object.assign(camera, {aspect: width / Math.max(1, tall), near: distance / 50, far: 20 * distance});
    camera.updateProjectionMatrix();
    for (const m of motions) m.pose(t);
    views.forEach((view, i) => {  // the last one of a view leads, the others are its ghosts
      const lead = view[view.length - 1], here = middle.clone();
      if (follows) here.add(lead.middle()).sub(lead.first);
      for (const m of motions) {
        m.group.visible = view.includes(m);
        m.group.position.copy(here).multiplyScalar(-scale);
        m.group.scale.setScalar(scale);
        m.dress(m !== lead);
      }
      renderer.setViewport(i * width, 0, width, tall);
      renderer.setScissor(i * width, 0, width, tall);
      renderer.render(scene, camera);
    });
    const now = start + t, passed = events.filter(e => e.t <= now).pop();
    part('label').textContent = 't = ' + now.toPrecision(4) + ' s' +
        (passed ? ', ' + passed.name + ' at ' + passed.t.toPrecision(4) + ' s' : '');
    document.dispatchEvent(new CustomEvent('costate-time', {detail: now}));
  };
  const fit = () => {
    renderer.setPixelRatio(devicePixelRatio);
    renderer.setSize(canvas.clientWidth, canvas.clientHeight, false);
    draw();
  };
  const play = on => { playing = on; button.textContent = on ? 'Pause' : 'Play'; };
  const seek = to => { play(false); t = Math.min(end, Math.max(0, to)); slider.value = t; draw(); };
  slider.max = end;
  slider.step = end / 1000 || 1;
  slider.oninput = () => seek(Number(slider.value));
  document.addEventListener('costate-seek', e => seek(e.detail - start));
  button.onclick = () => play(!playing);
  if (layout) layout.onchange = draw;
  const controls = new THREE.OrbitControls(camera, canvas);
  controls.screenSpacePanning = true;
  controls.update();
  controls.addEventListener('change', draw);
  canvas.addEventListener('wheel', e => {  // is the page's on one longer than the window, until the view has been clicked
    const long = document.documentElement.scrollHeight > innerHeight + 1;
    controls.enableZoom = !long || document.activeElement === canvas || e.ctrlKey;
  }, true);  // before the controls hear of it
  const marks = part('marks');  // the slider's button is some 16 pixels wide
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
  fit();
  new ResizeObserver(fit).observe(canvas);
  document.body.dataset.drawn = motions.reduce((sum, m) => sum + m.solids.length, 0);
  requestAnimationFrame(frame);
})();
)js";
}

}  // namespace costate::app
