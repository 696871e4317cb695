// What the 3D view of reports uses of three.js; everything else is left out of the bundle.
export {
  BufferAttribute, BufferGeometry, DirectionalLight, DoubleSide, Group, HemisphereLight,
  LineBasicMaterial, LineSegments, Mesh, MeshLambertMaterial, PerspectiveCamera, Points,
  PointsMaterial, Scene, SphereGeometry, MeshBasicMaterial, Vector3, WebGLRenderer,
} from 'three';
export { OrbitControls } from 'three/addons/controls/OrbitControls.js';
