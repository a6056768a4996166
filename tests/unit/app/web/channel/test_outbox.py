"""The newest item is always processed, also one that comes at the moment when the last one is done."""

import asyncio

from cocalib.web.channel.newest import NewestWins


def test_an_item_that_comes_between_the_end_of_the_last_one_and_its_callback_is_processed() -> None:
    async def run() -> list[int]:
        done: list[int] = []
        finished = asyncio.get_running_loop().create_future()

        async def work(item: int) -> None:
            done.append(item)
            if item == 1:
                asyncio.get_running_loop().call_soon(worker.give, 2)  # runs once the task is done, before its callback
            else:
                finished.set_result(None)

        worker = NewestWins(work)
        worker.give(1)
        await asyncio.wait_for(finished, 5)
        return done

    assert asyncio.run(run()) == [1, 2]


def test_of_items_that_come_meanwhile_only_the_newest_is_processed() -> None:
    async def run() -> list[int]:
        done: list[int] = []
        proceed = asyncio.Event()

        async def work(item: int) -> None:
            await proceed.wait()
            done.append(item)

        worker = NewestWins(work)
        for item in range(5):
            worker.give(item)
            await asyncio.sleep(0)
        proceed.set()
        for _ in range(10):
            await asyncio.sleep(0)
        return done

    assert asyncio.run(run()) == [0, 4]
