// The colours of the scene.
import * as THREE from 'three';

// Shaders write the numbers as they stand, so three.js must not convert them either.
THREE.ColorManagement.enabled = false;

/** Red, green, blue in 24 bits. The legend says in words what they stand for. */
export const COLORS = {
  background: 0x1c232b,
  grid: 0x34404c,
  statics: 0x8a949e,
  floor: 0x3d4853,
  floorHit: 0x66423f,
  hit: 0xeb2f28,
  falsePositive: 0xff8ad8,
  masked: 0x7d8791,
  contact: 0xffffff,
  leafBox: 0x7fd4ff,
  innerBox: 0xb79bff,
  selected: 0xffffff,
} as const;

/**
 * Of characters, one after the other. The first two, blue and amber, differ for whoever sees no difference of red and
 * green, and both differ from the red of hits in brightness.
 */
export const CHARACTERS =
    [0x4f9cf5, 0xf9dd8a, 0x63c7a4, 0xb39ce8, 0x8ed4ee, 0xd5dd78, 0x9aa7f2, 0x7fb8a0] as const;

export function characterColor(batch: number, instance: number): number {
  return CHARACTERS[(batch + instance) % CHARACTERS.length]!;
}

/** The colour with its brightness multiplied. */
export function shaded(rgb: number, factor: number): number {
  const part = (shift: number): number => Math.min(255, Math.round(((rgb >> shift) & 255) * factor)) << shift;
  return part(16) | part(8) | part(0);
}
