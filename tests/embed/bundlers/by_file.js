import {load} from 'cab-collision';
import {touching} from './arms.js';

async function main() {
  document.body.textContent = touching(await load());
}
main();
