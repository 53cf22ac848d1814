// Unit quaternions (w, x, y, z); `a_from_b` turns coordinates in b into those in a.

export function multiply([aw, ax, ay, az], [bw, bx, by, bz]) {
  return [
    aw * bw - ax * bx - ay * by - az * bz,
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
  ];
}

export const conjugate = ([w, x, y, z]) => [w, -x, -y, -z];

export const fromYaw = (yaw) => [Math.cos(yaw / 2), 0, 0, Math.sin(yaw / 2)];

// Heading of z-y-x angles.
export const yawOf = ([w, x, y, z]) => Math.atan2(2 * (w * z + x * y), 1 - 2 * (y * y + z * z));

export function fromAxis([x, y, z], angle) {
  const s = Math.sin(angle / 2);
  return [Math.cos(angle / 2), s * x, s * y, s * z];
}

// The first two columns of the rotation matrix, row by row.
export function twoColumns([w, x, y, z]) {
  return [
    1 - 2 * (y * y + z * z), 2 * (x * y - w * z),
    2 * (x * y + w * z), 1 - 2 * (x * x + z * z),
    2 * (x * z - w * y), 2 * (y * z + w * x),
  ];
}

export function rotate(q, [x, y, z]) {
  const [, rx, ry, rz] = multiply(multiply(q, [0, x, y, z]), conjugate(q));
  return [rx, ry, rz];
}
