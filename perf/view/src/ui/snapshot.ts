// A picture of a pair of links in a recording, which is drawn aside.
import type {EngineInPage} from '../engine/types.js';
import type {Recording} from '../recording/types.js';
import type {Hit} from '../scene/hits.js';
import {SceneView} from '../scene/scene_view.js';
import {Stage} from '../scene/stage.js';
import {el} from './dom.js';

/** The address of a PNG. `engine` finds triangles of skins; without one whole links are red. */
export async function snapshot(recording: Recording, engine: EngineInPage | null, index: number, pair: Hit,
                               width: number, height: number): Promise<string> {
  const frame = recording.frame(index);
  const stage = new Stage(recording, [frame], false);
  const surface = el('div', {class: 'snapshot', 'aria-hidden': 'true'});
  surface.style.setProperty('width', `${width}px`);
  surface.style.setProperty('height', `${height}px`);
  document.body.append(surface);
  const view = new SceneView(surface, stage);
  try {
    view.resize();
    stage.show({
      frame, hits: frame.hits, contacts: frame.contacts, falsePositives: null,
      triangles: engine?.touchingTriangles(frame, frame.hits) ?? null, selection: {instance: null, pair},
      eye: view.viewpoint.camera.position,
    });
    const place = stage.pairPlace;
    // Farther away than in the viewer: one sees who it is.
    if (place) view.viewpoint.flyTo(place.center, 2.5 * place.radius, place.normal);
    view.viewpoint.advance(Infinity);
    return await addressOf(await view.picture());
  } finally {
    view.dispose();
    stage.dispose();
    surface.remove();
  }
}

// The page's policy shows images of data: alone.
function addressOf(picture: Blob): Promise<string> {
  return new Promise((done, fail) => {
    const reader = new FileReader();
    reader.addEventListener('load', () => done(String(reader.result)));
    reader.addEventListener('error', () => fail(reader.error));
    reader.readAsDataURL(picture);
  });
}
