/** Angles and directions in words. */

/** @param {number} angle deg, positive to the left */
export const sideways = (angle) => `${Math.abs(angle).toFixed(1)}° ${angle > 0 ? "left" : "right"}`;

/** @param {number} angle deg, positive upwards */
export const upwards = (angle) => `${Math.abs(angle).toFixed(1)}° ${angle < 0 ? "down" : "up"}`;

/** Angle of a direction [deg]. @param {number} across @param {number} along */
export const degrees = (across, along) => (Math.atan2(across, along) * 180) / Math.PI;
