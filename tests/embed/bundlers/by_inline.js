import {load} from 'cab-collision/inline';
import {touching} from './arms.js';

async function main() {
  document.body.textContent = touching(await load());
}
main();
