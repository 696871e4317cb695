'use strict';
// The 3D view of a report: measured points, fitted meshes and skeletons of a few frames.
//
// Data is in the camera frame (x right, y down, z forward) in millimetres; three.js has y up and
// looks along -z, so that y and z change their sign. Nothing is drawn while nothing changes.

const FOV_DEG = 42;
const VISIBLE = 0;
const LAYERS = [['room', 'room'], ['people', 'points of people'], ['mesh', 'bodies'],
                ['skeleton', 'joints']];
const PLACES = [['oblique', [0.50, 0.26, 0.83]], ['camera', null], ['side', [1, 0, 0.001]],
                ['above', [0, 1, 0.001]]];

function decode(text, Kind) {
  const bytes = Uint8Array.from(atob(text), letter => letter.charCodeAt(0));
  return new Kind(bytes.buffer);
}

function positions(text) {
  const mm = decode(text, Int16Array);
  const out = new Float32Array(mm.length);
  for (let i = 0; i < mm.length; i++) out[i] = mm[i] * (i % 3 ? -0.001 : 0.001);
  return out;
}

function geometry(xyz) {
  const made = new THREE.BufferGeometry();
  made.setAttribute('position', new THREE.BufferAttribute(xyz, 3));
  return made;
}

function cloud(points, size) {
  const made = geometry(positions(points.xyz));
  made.setAttribute('color', new THREE.BufferAttribute(decode(points.rgb, Uint8Array), 3, true));
  return new THREE.Points(made, new THREE.PointsMaterial({size, vertexColors: true}));
}

function mesh(person, faces) {
  const made = geometry(positions(person.vertices));
  made.setIndex(new THREE.BufferAttribute(faces, 1));
  made.computeVertexNormals();
  return new THREE.Mesh(made, new THREE.MeshLambertMaterial({
    color: person.color, side: THREE.DoubleSide, transparent: true, opacity: 0.88}));
}

// Bones and joints show through the body; joints that the camera does not see are small and dark.
function skeleton(person, parents) {
  const group = new THREE.Group();
  const xyz = positions(person.joints);
  const at = joint => xyz.slice(3 * joint, 3 * joint + 3);
  const ends = parents.flatMap((parent, joint) => parent < 0 ? [] : [...at(parent), ...at(joint)]);
  const over = {depthTest: false, transparent: true};
  const bones = new THREE.LineSegments(
    geometry(new Float32Array(ends)), new THREE.LineBasicMaterial({color: 0x20242a, ...over}));
  bones.renderOrder = 1;
  group.add(bones);
  person.states.forEach((state, joint) => {
    const seen = state === VISIBLE;
    const ball = new THREE.Mesh(
      new THREE.SphereGeometry(seen ? 0.022 : 0.014, 12, 8),
      new THREE.MeshBasicMaterial({color: seen ? 0xfafaf8 : 0x20242a, ...over}));
    ball.position.set(...at(joint));
    ball.renderOrder = 2;
    group.add(ball);
  });
  return group;
}

function layersOf(frame, data, faces) {
  const layers = Object.fromEntries(LAYERS.map(([name]) => [name, new THREE.Group()]));
  layers.room.add(cloud(frame.room, 0.018));
  layers.people.add(cloud(frame.people, 0.009));
  for (const person of frame.bodies) {
    layers.mesh.add(mesh(person, faces));
    layers.skeleton.add(skeleton(person, data.parents));
  }
  return layers;
}

function lights() {
  const sun = new THREE.DirectionalLight(0xffffff, 1.9);
  sun.position.set(-0.8, 1.4, 1.6);
  return [new THREE.HemisphereLight(0xffffff, 0x8a8f98, 1.5), sun];
}

function build(root) {
  const data = JSON.parse(root.querySelector('script').textContent);
  const faces = decode(data.faces, Uint16Array);
  const canvas = root.querySelector('canvas');
  const renderer = new THREE.WebGLRenderer({canvas, antialias: true, alpha: true});
  const scene = new THREE.Scene();
  scene.add(...lights());
  const camera = new THREE.PerspectiveCamera(FOV_DEG, 1, 0.05, 60);
  const controls = new THREE.OrbitControls(camera, canvas);
  const frames = data.frames.map(frame => layersOf(frame, data, faces));
  frames.forEach(layers => Object.values(layers).forEach(layer => scene.add(layer)));
  const center = new THREE.Vector3(data.center[0], -data.center[1], -data.center[2]);
  let shown = Math.floor(frames.length / 2);

  const draw = () => renderer.render(scene, camera);
  const choose = () => {
    frames.forEach((layers, number) => {
      for (const [name, layer] of Object.entries(layers)) {
        layer.visible = number === shown && root.querySelector(`[name=${name}]`).checked;
      }
    });
    root.querySelector('figcaption').textContent = data.frames[shown].caption;
    draw();
  };
  const look = direction => {
    const far = data.radius / Math.tan(FOV_DEG * Math.PI / 360) * 1.12;
    camera.position.copy(center);
    if (direction) camera.position.addScaledVector(new THREE.Vector3(...direction).normalize(), far);
    else camera.position.set(0, 0, 0);
    controls.target.copy(center);
    controls.update();
    draw();
  };
  const fit = () => {
    const {clientWidth, clientHeight} = canvas;
    renderer.setPixelRatio(window.devicePixelRatio);
    renderer.setSize(clientWidth, clientHeight, false);
    camera.aspect = clientWidth / clientHeight;
    camera.updateProjectionMatrix();
    draw();
  };
  root.querySelectorAll('[data-place]').forEach((button, number) =>
    button.addEventListener('click', () => look(PLACES[number][1])));
  root.querySelectorAll('[type=checkbox]').forEach(box => box.addEventListener('change', choose));
  const slider = root.querySelector('[type=range]');
  slider.addEventListener('input', () => { shown = Number(slider.value); choose(); });
  controls.addEventListener('change', draw);
  window.addEventListener('resize', fit);
  fit(); choose(); look(PLACES[0][1]);
}

for (const root of document.querySelectorAll('.scene3d')) {
  const bar = root.querySelector('.bar');
  for (const [name] of PLACES) bar.insertAdjacentHTML(
    'beforeend', `<button type="button" data-place="${name}">${name}</button>`);
  for (const [name, label] of LAYERS) bar.insertAdjacentHTML(
    'beforeend', `<label><input type="checkbox" name="${name}" checked> ${label}</label>`);
  try {
    build(root);
  } catch (error) {
    root.querySelector('figcaption').textContent =
      `The 3D view needs WebGL, which this browser does not give: ${error.message}`;
  }
}
