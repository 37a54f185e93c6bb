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
  hit: 0xff4a3d,
  falsePositive: 0xffb52e,
  masked: 0x7d8791,
  contact: 0xffffff,
  leafBox: 0x7fd4ff,
  innerBox: 0xb79bff,
  selected: 0xffffff,
} as const;

/** Of characters, one after the other. None is near red or amber. */
const CHARACTERS = [0x6fa8dc, 0x7fc8a9, 0xa99bdc, 0x8fb7c9, 0x9fc46f, 0xc39ac6, 0x5fb7b7, 0x8ea0e0] as const;

export function characterColor(batch: number, instance: number): number {
  return CHARACTERS[(batch * 3 + instance) % CHARACTERS.length]!;
}

/** The colour with its brightness multiplied. */
export function shaded(rgb: number, factor: number): number {
  const part = (shift: number): number => Math.min(255, Math.round(((rgb >> shift) & 255) * factor)) << shift;
  return part(16) | part(8) | part(0);
}
